in float v_shade;
out vec4 colour;
void main() { colour = vec4(1.0, 1.0, 1.0, v_shade); }

in vec2 v_spot; flat in vec3 v_look;
out vec4 colour;
void main() {
  vec2 a = abs(v_spot);
  float box = max(smoothstep(v_look.y, 1.0, a.x), smoothstep(v_look.y, 1.0, a.y));
  float round_ = smoothstep(v_look.y, 1.0, length(v_spot));
  float edge = v_look.y > 0.3 ? max(box, round_ * 0.0) : round_;
  colour = vec4(1.0, 1.0, 1.0, 1.0 - v_look.x * (1.0 - edge));
}

"""Reading one sign, panel or light: crops, the embedded reader, evidence over frames, and the published fact."""

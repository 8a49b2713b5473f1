// Constants that every method shares.

const TAU: f32 = 6.283185307179586;

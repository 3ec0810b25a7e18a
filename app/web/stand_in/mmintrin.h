#pragma once
// Eigen asks for MMX beside SSE2 and uses nothing of it; browsers have SSE2's operations as SIMD, and no MMX.

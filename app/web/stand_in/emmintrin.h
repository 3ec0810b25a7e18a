#pragma once
/// Emscripten's SSE2 with vectors of equal numbers compiled as they are written. Clang 14 for WebAssembly
/// reads such a number from memory where the vector is used, after what has been written there since: its
/// load64_splat has no place in the order of memory's accesses. Here the number is in a register first.

#include_next <emmintrin.h>

static inline __m128d splat_pd(double x) {
    __asm("" : "+r"(x));
    return _mm_set1_pd(x);
}
static inline __m128 splat_ps(float x) {
    __asm("" : "+r"(x));
    return _mm_set1_ps(x);
}
static inline __m128i splat_epi32(int x) {
    __asm("" : "+r"(x));
    return _mm_set1_epi32(x);
}
static inline __m128i splat_epi64x(long long x) {
    __asm("" : "+r"(x));
    return _mm_set1_epi64x(x);
}

#undef _mm_set_pd1
#undef _mm_set1_ps
#define _mm_set1_pd splat_pd
#define _mm_set_pd1 splat_pd
#define _mm_set1_ps splat_ps
#define _mm_set_ps1 splat_ps
#define _mm_set1_epi32 splat_epi32
#define _mm_set1_epi64x splat_epi64x

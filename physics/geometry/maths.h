#pragma once
/// Elementary functions with the same bits everywhere. C++ leaves the last bits of std::sin to each system's
/// library, and a state is compared to the bit: between two versions of glibc, and between a program and a
/// browser. These are made of additions, multiplications, divisions and square roots of IEEE 754 alone, which
/// have one result; the build must neither contract nor reorder them (-ffp-contract=off, no -ffast-math).
///
/// sin, cos, exp, log, log10 and pow are within 1 ulp of the exact value, the others within 2.5. Special
/// values are those of C99 Annex F; neither errno nor floating-point flags are set. std::sqrt,
/// std::remainder, std::round and the like are exact by definition and need no stand-in.
///
/// Methods: argument reduction in parts (Cody and Waite, Software Manual for the Elementary Functions, 1980),
/// Taylor series of the reduced argument, double-double products (Dekker, Numer. Math. 18, 1971).

#include <utility>

#include "physics/geometry/vec.h"

namespace geometry {

/// Of x [rad]. Beyond 2^20 rad x is first reduced by the double nearest to 2π, whose error then counts.
double sin(double x);
double cos(double x);
double tan(double x);
/// {sin x, cos x}, with the bits of the functions above.
std::pair<double, double> sin_cos(double x);

double asin(double x);
double acos(double x);
double atan(double x);
double atan2(double y, double x);
/// √(x² + y²), without overflow or underflow in between.
double hypot(double x, double y);

double exp(double x);
double log(double x);
double log10(double x);
double pow(double x, double y);
double cbrt(double x);

/// A turn by `angle` [rad] about the unit vector `axis` (Rodrigues).
Mat3 rotation(double angle, const Vec3& axis);

}  // namespace geometry

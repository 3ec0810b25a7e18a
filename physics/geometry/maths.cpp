#include "physics/geometry/maths.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace geometry {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// An unevaluated sum of two doubles, the second below half an ulp of the first.
struct Pair {
    double high = 0, low = 0;
};
constexpr Pair half_pi{0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};
constexpr Pair third{0x1.5555555555555p-2, 0x1.5555555555555p-56};
/// The first part has trailing zeros, so that its products with whole numbers below 2^11 are exact.
constexpr Pair ln2{0x1.62e42fefa3800p-1, 0x1.ef35793c76730p-45};
constexpr Pair log10_e{0x1.bcb7b1526e50ep-2, 0x1.95355baaafad3p-57};
constexpr double log2_e = 0x1.71547652b82fep+0, two_over_pi = 0x1.45f306dc9c883p-1;

/// Adding and taking away this rounds |x| < 2^51 to a whole number, in the usual mode of rounding.
constexpr double rounder = 0x1.8p52;
double nearest(double x) {
    return (x + rounder) - rounder;
}

Pair sum(double a, double b) {
    const double s = a + b, of_b = s - a;
    return {s, (a - (s - of_b)) + (b - of_b)};
}
/// For |a| >= |b|.
Pair quick_sum(double a, double b) {
    const double s = a + b;
    return {s, b - (s - a)};
}
Pair product(double a, double b) {
    const auto split = [](double x) {
        const double c = 0x1.0000002p27 * x, high = c - (c - x);
        return Pair{high, x - high};
    };
    const double p = a * b;
    const Pair x = split(a), y = split(b);
    return {p, ((x.high * y.high - p) + x.high * y.low + x.low * y.high) + x.low * y.low};
}
Pair product(Pair a, Pair b) {
    const Pair p = product(a.high, b.high);
    return quick_sum(p.high, p.low + (a.high * b.low + a.low * b.high));
}
Pair sum(Pair a, Pair b) {
    const Pair s = sum(a.high, b.high);
    return quick_sum(s.high, s.low + (a.low + b.low));
}

/// 1/n!
constexpr auto inverse_factorials = [] {
    std::array<double, 20> f{};
    double n = 1;
    for (int k = 0; k < 20; ++k) {
        f[static_cast<std::size_t>(k)] = 1 / n;  // n is exact to 18!, and rounds once after it
        n *= k + 1;
    }
    return f;
}();

/// Σ c[k] z^k
template <std::size_t N>
double polynomial(const std::array<double, N>& c, double z) {
    double s = c[N - 1];
    for (std::size_t k = N - 1; k-- > 0;) s = s * z + c[k];
    return s;
}

/// sin(r + e)/r³ and so on for |r| <= π/4 and e below its ulp.
constexpr auto sine_terms = [] {  // −1/3!, 1/5!, … to r^17
    std::array<double, 8> c{};
    for (std::size_t k = 0; k < 8; ++k) c[k] = (k % 2 == 0 ? -1 : 1) * inverse_factorials[2 * k + 3];
    return c;
}();
constexpr auto cosine_terms = [] {  // 1/4!, −1/6!, … to r^16
    std::array<double, 7> c{};
    for (std::size_t k = 0; k < 7; ++k) c[k] = (k % 2 == 0 ? 1 : -1) * inverse_factorials[2 * k + 4];
    return c;
}();
double sine_near(double r, double e) {
    if (r == 0) return r;  // of either sign
    const double z = r * r;
    return r + (r * z * polynomial(sine_terms, z) + e * (1 - 0.5 * z));
}
double cosine_near(double r, double e) {
    const double z = r * r, half = 0.5 * z, w = 1 - half;
    return w + (((1 - w) - half) + (z * z * polynomial(cosine_terms, z) - r * e));
}

/// x = quarter · π/2 + r + e with |r| <= π/4, nearly.
struct Reduced {
    double r = 0, e = 0;
    unsigned quarter = 0;  // modulo 4
};
constexpr double largest_angle = 0x1p20;
Reduced reduced(double x) {
    if (!(std::abs(x) < largest_angle)) x = std::remainder(x, 4 * half_pi.high);  // NaN of an infinite one
    if (!(std::abs(x) > 0.5 * half_pi.high)) return {x, 0, 0};
    // π/2 in parts of 33, 33 and 53 bits: the first two products with k < 2^20 are exact.
    constexpr double first = 0x1.921fb54400000p+0, second = 0x1.0b4611a600000p-34,
                     third_part = 0x1.3198a2e037073p-69;
    const double k = nearest(x * two_over_pi);
    const Pair r = sum(x - k * first, -k * second);
    const Pair with_rest = sum(r.high, r.low - k * third_part);
    return {with_rest.high, with_rest.low, static_cast<unsigned>(static_cast<std::int64_t>(k)) & 3u};
}
double sine_of(const Reduced& a) {
    const double s = a.quarter % 2 == 0 ? sine_near(a.r, a.e) : cosine_near(a.r, a.e);
    return a.quarter < 2 ? s : -s;
}
double cosine_of(const Reduced& a) {
    const double c = a.quarter % 2 == 0 ? cosine_near(a.r, a.e) : sine_near(a.r, a.e);
    return a.quarter == 0 || a.quarter == 3 ? c : -c;
}

/// atan(k/8), k = 0 … 8.
constexpr std::array<Pair, 9> arc_of_eighths = {{{0, 0},
                                                 {0x1.fd5ba9aac2f6ep-4, -0x1.cd37686760c17p-59},
                                                 {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
                                                 {0x1.6f61941e4def1p-2, -0x1.c63aae6f6e918p-56},
                                                 {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
                                                 {0x1.1e00babdefeb4p-1, -0x1.928df287a668fp-58},
                                                 {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
                                                 {0x1.700a7c5784634p-1, -0x1.8c34d25aadef6p-56},
                                                 {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55}}};
constexpr auto arc_terms = [] {  // −1/3, 1/5, … to t^17
    std::array<double, 8> c{};
    for (int k = 0; k < 8; ++k) c[static_cast<std::size_t>(k)] = (k % 2 == 0 ? -1.0 : 1.0) / (2 * k + 3);
    return c;
}();
/// atan(small / large) for 0 <= small <= large, both within the range where their products are normal.
Pair arc_of(double small, double large) {
    const double k = nearest(8 * (small / large));
    const double c = k / 8;
    const Pair up = product(c, large);  // exact: c has three bits, so that `up` rarely has a second part
    const double t = ((small - up.high) - up.low) / (large + c * small);
    const double z = t * t;
    const Pair& known = arc_of_eighths[static_cast<std::size_t>(k)];
    return quick_sum(known.high, t + (t * z * polynomial(arc_terms, z) + known.low));
}

/// 2^k, for −1022 <= k <= 1023.
double power_of_two(int k) {
    return std::bit_cast<double>(static_cast<std::uint64_t>(k + 1023) << 52);
}

constexpr auto exponential_terms = [] {  // 1/2!, 1/3!, … to r^14
    std::array<double, 13> c{};
    for (std::size_t k = 0; k < 13; ++k) c[k] = inverse_factorials[k + 2];
    return c;
}();
/// e^(x + e), e below an ulp of x or so.
double exponential(double x, double e) {
    if (x > 709.79) return infinity;
    if (x < -745.2) return 0;
    const double k = nearest(x * log2_e);
    const Pair r = sum(x - k * ln2.high, e - k * ln2.low);
    const Pair value =
        quick_sum(1, r.high + (r.high * r.high * polynomial(exponential_terms, r.high) + r.low));
    const int n = static_cast<int>(k), half = n / 2;
    return (value.high + value.low) * power_of_two(half) * power_of_two(n - half);
}

/// x = m · 2^k with √½ < m <= √2, of a positive finite x.
struct Scaled {
    double m = 1;
    int k = 0;
};
Scaled scaled(double x) {
    int k = 0;
    if (x < std::numeric_limits<double>::min()) x *= 0x1p54, k = -54;
    auto bits = std::bit_cast<std::uint64_t>(x);
    k += static_cast<int>(bits >> 52) - 1023;
    bits = (bits & 0x000fffffffffffffu) | 0x3ff0000000000000u;
    double m = std::bit_cast<double>(bits);
    if (m > 0x1.6a09e667f3bcdp0) m *= 0.5, ++k;
    return {m, k};
}

constexpr auto logarithm_terms = [] {  // 1/5, 1/7, … to s^23
    std::array<double, 10> c{};
    for (int k = 0; k < 10; ++k) c[static_cast<std::size_t>(k)] = 1.0 / (2 * k + 5);
    return c;
}();
/// ln x to about 2^-65 of itself, of a positive finite x: ln m = 2 artanh s, s = (m − 1)/(m + 1).
Pair logarithm(double x) {
    const auto [m, k] = scaled(x);
    const double f = m - 1;  // exact
    const Pair under = sum(m, 1);
    const double high = f / under.high;
    const Pair back = product(high, under.high);
    const Pair s = quick_sum(high, ((f - back.high) - back.low - high * under.low) / under.high);
    const Pair square = product(s, s), cube = product(square, s);
    const double z = square.high;
    const double tail = z * z * s.high * polynomial(logarithm_terms, z);
    const Pair series = sum(s, sum(product(cube, third), Pair{tail, 0}));
    const Pair of_m{2 * series.high, 2 * series.low};
    return sum(sum(product(k, ln2.high), Pair{k * ln2.low, 0}), of_m);
}

bool is_whole(double y) {
    return std::abs(y) >= 0x1p53 || std::trunc(y) == y;
}
bool is_odd(double y) {
    return std::abs(y) < 0x1p53 && std::trunc(y) == y && std::trunc(y / 2) * 2 != y;
}

}  // namespace

double sin(double x) {
    return sine_of(reduced(x));
}

double cos(double x) {
    return cosine_of(reduced(x));
}

double tan(double x) {
    const Reduced a = reduced(x);
    return sine_of(a) / cosine_of(a);
}

std::pair<double, double> sin_cos(double x) {
    const Reduced a = reduced(x);
    return {sine_of(a), cosine_of(a)};
}

double atan2(double y, double x) {
    if (std::isnan(x) || std::isnan(y)) return x + y;
    double across = std::abs(y), along = std::abs(x);
    if (std::isinf(across) || std::isinf(along))
        across = std::isinf(across) ? 1 : 0, along = std::isinf(along) ? 1 : 0;
    Pair angle;
    if (across > 0 || along > 0) {
        const bool is_steep = across > along;
        double small = is_steep ? along : across, large = is_steep ? across : along;
        if (large > 0x1p900) small *= 0x1p-60, large *= 0x1p-60;
        if (large < 0x1p-900) small *= 0x1p120, large *= 0x1p120;
        angle = arc_of(small, large);
        if (is_steep) angle = sum(half_pi, {-angle.high, -angle.low});
    }
    if (std::signbit(x)) angle = sum({2 * half_pi.high, 2 * half_pi.low}, {-angle.high, -angle.low});
    return std::copysign(angle.high + angle.low, y);
}

double atan(double x) {
    return atan2(x, 1);
}

double asin(double x) {
    return atan2(x, std::sqrt((1 - x) * (1 + x)));
}

double acos(double x) {
    return atan2(std::sqrt((1 - x) * (1 + x)), x);
}

double hypot(double x, double y) {
    if (std::isinf(x) || std::isinf(y)) return infinity;
    double large = std::abs(x), small = std::abs(y);
    if (large < small) std::swap(large, small);
    if (large > 0x1p500)
        return std::sqrt((large * 0x1p-600) * (large * 0x1p-600) + (small * 0x1p-600) * (small * 0x1p-600)) *
               0x1p600;
    if (large < 0x1p-400)
        return std::sqrt((large * 0x1p600) * (large * 0x1p600) + (small * 0x1p600) * (small * 0x1p600)) *
               0x1p-600;
    return std::sqrt(large * large + small * small);
}

double exp(double x) {
    return std::isnan(x) ? x : exponential(x, 0);
}

double log(double x) {
    if (!(x > 0)) return x == 0 ? -infinity : nan;
    if (std::isinf(x)) return x;
    const Pair value = logarithm(x);
    return value.high + value.low;
}

double log10(double x) {
    if (!(x > 0)) return x == 0 ? -infinity : nan;
    if (std::isinf(x)) return x;
    const Pair value = product(logarithm(x), log10_e);
    return value.high + value.low;
}

double pow(double x, double y) {
    if (y == 0 || x == 1) return 1;
    if (std::isnan(x) || std::isnan(y)) return x + y;
    const bool negative = std::signbit(x) && is_odd(y);
    const double size = std::abs(x);
    const auto with_sign = [negative](double value) { return negative ? -value : value; };
    if (std::isinf(y)) return size == 1 ? 1 : (size > 1) == (y > 0) ? infinity : 0;
    if (size == 1) return with_sign(is_whole(y) || x > 0 ? 1 : nan);
    if (size == 0 || std::isinf(size)) return with_sign((size == 0) == (y < 0) ? infinity : 0);
    if (x < 0 && !is_whole(y)) return nan;
    if (y == 1) return x;
    if (y == 2) return x * x;
    const Pair of_x = logarithm(size);
    if (std::abs(y) > 0x1p80) return with_sign((of_x.high > 0) == (y > 0) ? infinity : 0);
    const Pair p = product(of_x.high, y);
    return with_sign(exponential(p.high, p.low + of_x.low * y));
}

double cbrt(double x) {
    if (x == 0 || !std::isfinite(x)) return x;
    if (std::abs(x) < 0x1p-900) return cbrt(x * 0x1p900) * 0x1p-300;
    const double size = pow(std::abs(x), third.high);
    // Newton's method once: a third is no double.
    const Pair square = product(size, size), cube = product(square, Pair{size, 0});
    return std::copysign(size - ((cube.high - std::abs(x)) + cube.low) / (3 * square.high), x);
}

Mat3 rotation(double angle, const Vec3& axis) {
    const auto [sine, cosine] = sin_cos(angle);
    Mat3 across;
    across << 0, -axis.z(), axis.y(), axis.z(), 0, -axis.x(), -axis.y(), axis.x(), 0;
    return cosine * Mat3::Identity() + sine * across + (1 - cosine) * axis * axis.transpose();
}

}  // namespace geometry

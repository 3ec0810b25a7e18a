#include "physics/geometry/maths.h"

#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <random>

#include "physics/geometry/hash.h"

namespace geometry {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Units in the last place of `exact`, as long as that is a double.
double ulps(double found, long double exact) {
    const auto rounded = static_cast<double>(exact);
    if (std::isnan(found) || std::isnan(rounded))
        return std::isnan(found) && std::isnan(rounded) ? 0 : infinity;
    if (std::isinf(found) || std::isinf(rounded)) return found == rounded ? 0 : infinity;
    const double size = std::max(std::abs(rounded), std::numeric_limits<double>::min());
    return static_cast<double>(std::abs(found - exact) / (std::nextafter(size, infinity) - size));
}

class Draw {
public:
    explicit Draw(std::uint64_t seed) : random_(seed) {}
    double between(double low, double high) {
        return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
    }
    double any() { return std::bit_cast<double>(std::uint64_t{random_()}); }
    /// Of either sign, from 2^low to 2^high.
    double sized(int low, int high) {
        const double size = std::ldexp(between(1, 2), static_cast<int>(std::floor(between(low, high))));
        return random_() % 2 == 0 ? size : -size;
    }

private:
    std::mt19937_64 random_;
};

constexpr int draws = 200'000;
constexpr std::uint64_t seed = 20261128;

template <class Drawn, class Found, class Exact>
double worst(const Drawn& drawn, const Found& found, const Exact& exact) {
    Draw draw(seed);
    double worst = 0;
    for (int k = 0; k < draws; ++k) {
        const double x = drawn(draw);
        worst = std::max(worst, ulps(found(x), exact(static_cast<long double>(x))));
    }
    return worst;
}
#define WORST(f, drawn)                                                 \
    worst([](Draw& d) { return drawn; }, [](double x) { return f(x); }, \
          [](long double x) { return std::f(x); })

template <class Drawn, class Found, class Exact>
double worst_of_two(const Drawn& drawn, const Found& found, const Exact& exact) {
    Draw draw(seed);
    double worst = 0;
    for (int k = 0; k < draws; ++k) {
        const double x = drawn(draw), y = drawn(draw);
        worst = std::max(worst,
                         ulps(found(x, y), exact(static_cast<long double>(x), static_cast<long double>(y))));
    }
    return worst;
}
#define WORST_OF_TWO(f, drawn)                                                              \
    worst_of_two([](Draw& d) { return drawn; }, [](double x, double y) { return f(x, y); }, \
                 [](long double x, long double y) { return std::f(x, y); })

}  // namespace

/// Against the extended precision of x86, where long double has it.
TEST(Maths, IsAsNearToTheExactValuesAsItSays) {
    if (std::numeric_limits<long double>::digits < 64)
        GTEST_SKIP() << "long double is no longer than double here";
    EXPECT_LT(WORST(sin, d.sized(-40, 20)), 1);
    EXPECT_LT(WORST(cos, d.sized(-40, 20)), 1);
    EXPECT_LT(WORST(sin, d.between(-8, 8)), 1);
    EXPECT_LT(WORST(cos, d.between(-8, 8)), 1);
    EXPECT_LT(WORST(exp, d.between(-745, 709.7)), 1);
    EXPECT_LT(WORST(exp, d.any()), 1);
    EXPECT_LT(WORST(log, std::abs(d.any())), 1);
    EXPECT_LT(WORST(log, d.between(0.3, 3)), 1);
    EXPECT_LT(WORST(log10, d.between(0.3, 3000)), 1);
    EXPECT_LT(WORST_OF_TWO(pow, std::abs(d.sized(-6, 6))), 1);
    EXPECT_LT(WORST(tan, d.between(-8, 8)), 2.5);
    EXPECT_LT(WORST(asin, d.between(-1, 1)), 2.5);
    EXPECT_LT(WORST(acos, d.between(-1, 1)), 2.5);
    EXPECT_LT(WORST(atan, d.sized(-60, 60)), 2.5);
    EXPECT_LT(WORST(cbrt, d.any()), 2.5);
    EXPECT_LT(WORST_OF_TWO(atan2, d.any()), 2.5);
    EXPECT_LT(WORST_OF_TWO(atan2, d.between(-3, 3)), 2.5);
    EXPECT_LT(WORST_OF_TWO(hypot, d.any()), 2.5);
    EXPECT_LT(WORST_OF_TWO(hypot, d.between(-3, 3)), 2.5);
}

TEST(Maths, TakesSpecialValuesAsTheStandardSays) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double values[] = {0.0, -0.0, 1,   -1,   infinity, -infinity, nan,    2,       -2,
                             3,   -3,   0.5, -0.5, 1e300,    -1e300,    5e-324, -1e-310, 0x1p53 + 2};
    const auto like = [](double found, double expected) {
        if (std::isnan(expected)) return std::isnan(found);
        return std::signbit(found) == std::signbit(expected) &&
               (found == expected || std::abs(found - expected) <= 5e-16 * std::abs(expected));
    };
#define LIKE(f) \
    EXPECT_TRUE(like(f(x), std::f(x))) << #f "(" << x << ") = " << f(x) << ", expected " << std::f(x)
#define LIKE2(f)                             \
    EXPECT_TRUE(like(f(x, y), std::f(x, y))) \
        << #f "(" << x << ", " << y << ") = " << f(x, y) << ", expected " << std::f(x, y)
    for (const double x : values) {
        if (!(std::abs(x) > 0x1p20) || std::isinf(x)) {
            LIKE(sin);
            LIKE(cos);
            LIKE(tan);
        }
        LIKE(asin);
        LIKE(acos);
        LIKE(atan);
        LIKE(exp);
        LIKE(log);
        LIKE(log10);
        LIKE(cbrt);
        for (const double y : values) {
            LIKE2(atan2);
            LIKE2(hypot);
            LIKE2(pow);
        }
    }
    EXPECT_LE(std::abs(sin(1e300)), 1);  // of an angle that says nothing any more
}

TEST(Maths, HasTheSameBitsOnEveryMachine) {
    Draw draw(seed);
    Hash hash;
    for (int k = 0; k < draws; ++k) {
        const double x = draw.between(-20, 20), y = draw.between(-20, 20), part = x / 20;
        for (const double value :
             {sin(x), cos(x), tan(x), asin(part), acos(part), atan(x), exp(x), log(std::abs(x)),
              log10(std::abs(x)), cbrt(x), atan2(y, x), hypot(x, y), pow(std::abs(x), y)})
            hash.add(value);
    }
    EXPECT_EQ(hash.value(), 8707575937527820135u);
}

TEST(Maths, SineAndCosineOfBothAreThoseOfEach) {
    Draw draw(seed);
    for (int k = 0; k < 1000; ++k) {
        const double x = draw.sized(-30, 30);
        EXPECT_EQ(sin_cos(x), std::pair(sin(x), cos(x)));
    }
}

TEST(Maths, ARotationIsEigens) {
    Draw draw(seed);
    for (int k = 0; k < 1000; ++k) {
        const Vec3 axis = Vec3(draw.between(-1, 1), draw.between(-1, 1), draw.between(-1, 1)).normalized();
        const double angle = draw.between(-10, 10);
        EXPECT_LT((rotation(angle, axis) - Eigen::AngleAxisd(angle, axis).toRotationMatrix()).norm(), 1e-14);
    }
}

}  // namespace geometry

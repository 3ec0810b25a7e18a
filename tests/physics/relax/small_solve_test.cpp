#include "physics/relax/small_solve.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

namespace physics {
namespace {

template <class N>
class SmallSolve : public testing::Test {};

using Sizes = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 4>,
                             std::integral_constant<int, 6>>;
TYPED_TEST_SUITE(SmallSolve, Sizes);

TYPED_TEST(SmallSolve, GivesTheBitsOfEigen) {
    constexpr int n = TypeParam::value;
    std::mt19937_64 random(n);
    std::normal_distribution<double> normal;
    int indefinite = 0;
    for (int trial = 0; trial < 4000; ++trial) {
        SCOPED_TRACE(trial);
        const Square<n> a = Square<n>::NullaryExpr([&] { return normal(random) * std::exp(normal(random)); });
        const Column<n> right = Column<n>::NullaryExpr([&] { return normal(random); });
        Square<n> factors = a;
        Column<n> x = right;
        solve_lu<n>(factors, x);
        EXPECT_EQ(x, Column<n>(a.partialPivLu().solve(right)));

        Square<n> square = a * a.transpose();
        if (trial % 4 == 0) square -= 0.5 * Square<n>::Identity();
        const Eigen::LLT<Square<n>> expected(square);
        const bool definite = cholesky<n>(square);
        ASSERT_EQ(definite, expected.info() == Eigen::Success);
        indefinite += !definite;
        if (!definite) continue;
        x = right;
        solve_cholesky<n>(square, x);
        EXPECT_EQ(x, Column<n>(expected.solve(right)));
    }
    EXPECT_GT(indefinite, 100);
}

}  // namespace
}  // namespace physics

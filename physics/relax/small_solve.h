#pragma once
/// Cholesky and LU of matrices of 2, 4 or 6 rows. Sums run in the order that Eigen 3.4 uses for these sizes,
/// so the results have the same bits; only the time to compile differs: Eigen's take eight seconds a size.

#include <Eigen/Core>
#include <cmath>
#include <type_traits>
#include <utility>

namespace physics {

/// Σ a_i b_i, i < Count, by halves.
template <int Count, class Left, class Right>
double halved_sum(const Left& a, const Right& b, int from = 0) {
    if constexpr (Count == 0)
        return 0;
    else if constexpr (Count == 1)
        return a(from) * b(from);
    else
        return halved_sum<Count / 2>(a, b, from) + halved_sum<Count - Count / 2>(a, b, from + Count / 2);
}

/// Σ a_i b_i, i < Count ≤ 5, of adjacent numbers, two at a time.
template <int Count, class Left, class Right>
double paired_sum(const Left& a, const Right& b) {
    const auto product = [&](int i) { return a(i) * b(i); };
    if constexpr (Count < 2)
        return halved_sum<Count>(a, b);
    else if constexpr (Count == 2)
        return product(0) + product(1);
    else if constexpr (Count == 3)
        return (product(0) + product(1)) + product(2);
    else if constexpr (Count == 4)
        return (product(0) + product(2)) + (product(1) + product(3));
    else
        return ((product(0) + product(2)) + (product(1) + product(3))) + product(4);
}

/// Calls `step` with the constants 0 to Count − 1.
template <int Count, class Step>
void each(const Step& step) {
    [&]<int... I>(std::integer_sequence<int, I...>) {
        (step(std::integral_constant<int, I>()), ...);
    }
    (std::make_integer_sequence<int, Count>());
}

template <int N>
using Square = Eigen::Matrix<double, N, N>;
template <int N>
using Column = Eigen::Matrix<double, N, 1>;

/// Writes L of a = L·Lᵀ into the lower triangle; false where `a` is not positive definite.
template <int N>
bool cholesky(Square<N>& a) {
    for (int k = 0; k < N; ++k) {
        double pivot = a(k, k), squares = 0;
        for (int j = 0; j < k; ++j) squares += a(k, j) * a(k, j);
        pivot -= squares;
        if (pivot <= 0) return false;
        a(k, k) = pivot = std::sqrt(pivot);
        for (int i = k + 1; i < N; ++i) {
            double sum = 0;
            for (int j = 0; j < k; ++j) sum += a(i, j) * a(k, j);
            a(i, k) = (a(i, k) - sum) / pivot;
        }
    }
    return true;
}

/// Solves L·Lᵀ·y = x and writes y to x.
template <int N>
void solve_cholesky(const Square<N>& l, Column<N>& x) {
    each<N>([&](auto row) {
        constexpr int i = row;
        x[i] = (x[i] - halved_sum<i>([&](int j) { return l(i, j); }, x)) / l(i, i);
    });
    each<N>([&](auto turn) {
        constexpr int i = N - 1 - turn;
        const auto below = [&](int j) { return l(i + 1 + j, i); };
        x[i] = (x[i] - paired_sum<turn>(below, [&](int j) { return x[i + 1 + j]; })) / l(i, i);
    });
}

/// Solves a·y = x by elimination, the largest pivot of each column first, and writes y to x.
template <int N>
void solve_lu(Square<N>& a, Column<N>& x) {
    for (int k = 0; k < N; ++k) {
        int largest = k;
        for (int i = k + 1; i < N; ++i)
            if (std::abs(a(i, k)) > std::abs(a(largest, k))) largest = i;
        if (a(largest, k) != 0) {
            for (int j = 0; j < N && largest != k; ++j) std::swap(a(k, j), a(largest, j));
            if (largest != k) std::swap(x[k], x[largest]);
            for (int i = k + 1; i < N; ++i) a(i, k) /= a(k, k);
        }
        for (int j = k + 1; j < N; ++j)
            for (int i = k + 1; i < N; ++i) a(i, j) -= a(i, k) * a(k, j);
    }
    each<N>([&](auto row) {
        constexpr int i = row;
        x[i] -= halved_sum<i>([&](int j) { return a(i, j); }, x);
    });
    each<N>([&](auto turn) {
        constexpr int i = N - 1 - turn;
        x[i] = (x[i] - halved_sum<turn>([&](int j) { return a(i, i + 1 + j); },
                                        [&](int j) { return x[i + 1 + j]; })) /
               a(i, i);
    });
}

}  // namespace physics

#pragma once
/// Central differences, to check analytic gradients and tensors against.

#include <Eigen/Core>
#include <functional>

/// df/dx of a scalar function of a vector; error O(h²).
inline Eigen::VectorXd finite_gradient(const std::function<double(const Eigen::VectorXd&)>& f,
                                       const Eigen::VectorXd& x, double h = 1e-5) {
    Eigen::VectorXd gradient(x.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) {
        // Richardson: two central differences cancel the h² term, so that h may stay far from rounding.
        auto slope = [&](double step) {
            Eigen::VectorXd up = x, down = x;
            up[i] += step;
            down[i] -= step;
            return (f(up) - f(down)) / (2 * step);
        };
        gradient[i] = (4 * slope(h) - slope(2 * h)) / 3;
    }
    return gradient;
}

/// d²f/dx² from central differences of a gradient.
inline Eigen::MatrixXd finite_hessian(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& gradient,
                                      const Eigen::VectorXd& x, double h = 1e-5) {
    Eigen::MatrixXd hessian(x.size(), x.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) {
        Eigen::VectorXd up = x, down = x;
        up[i] += h;
        down[i] -= h;
        hessian.col(i) = (gradient(up) - gradient(down)) / (2 * h);
    }
    return hessian;
}

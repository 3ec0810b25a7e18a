#include "engine/patient/cell_means.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <thread>
#include <vector>

#include "physics/geometry/parallel.h"

namespace patient {
namespace {

/// Solves the equations of the header along an axis by elimination (Thomas). The matrix depends on the
/// number of samples alone, and its diagonal outweighs the rest.
class MeansAlongAxis {
public:
    explicit MeansAlongAxis(int count) {
        for (int i = 0; i < count; ++i) {
            const double own = 0.75 + (i == 0 ? beside : 0.0) + (i + 1 == count ? beside : 0.0);
            const double pivot = own - (i == 0 ? 0.0 : beside * after_.back());
            inverse_.push_back(static_cast<float>(1.0 / pivot));
            after_.push_back(static_cast<float>(beside / pivot));
        }
    }

    /// For `lines` neighbouring lines; from a sample to the next it is `stride`.
    void solve(float* values, std::size_t lines, std::size_t stride) const {
        constexpr auto fraction = static_cast<float>(beside);
        for (std::size_t i = 0; i < inverse_.size(); ++i) {
            float* at = values + i * stride;
            for (std::size_t line = 0; line < lines; ++line) {
                const float before = i == 0 ? 0.0f : fraction * (at - stride)[line];
                at[line] = (at[line] - before) * inverse_[i];
            }
        }
        for (std::size_t i = inverse_.size() - 1; i-- > 0;) {
            float* at = values + i * stride;
            for (std::size_t line = 0; line < lines; ++line) at[line] -= after_[i] * (at + stride)[line];
        }
    }

private:
    static constexpr double beside = 0.125;
    std::vector<float> inverse_, after_;
};

std::int16_t rounded(float hu) {
    using Limits = std::numeric_limits<std::int16_t>;
    return static_cast<std::int16_t>(
        std::lrint(std::clamp(hu, static_cast<float>(Limits::min()), static_cast<float>(Limits::max()))));
}

}  // namespace

void interpolate_means(CtImage& ct) {
    const auto nx = static_cast<std::size_t>(ct.grid.size[0]), ny = static_cast<std::size_t>(ct.grid.size[1]),
               nz = static_cast<std::size_t>(ct.grid.size[2]);
    const MeansAlongAxis x(ct.grid.size[0]), y(ct.grid.size[1]), z(ct.grid.size[2]);
    const int threads = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, 64u));
    geometry::parallel_for(
        nz, threads,
        [&](std::size_t k) {
            std::int16_t* layer = ct.hu.data() + k * nx * ny;
            std::vector<float> values(layer, layer + nx * ny);
            for (std::size_t j = 0; j < ny; ++j) x.solve(values.data() + j * nx, 1, 1);
            y.solve(values.data(), nx, nx);
            std::transform(values.begin(), values.end(), layer, rounded);
        },
        {}, std::size_t{4});
    geometry::parallel_for(
        ny, threads,
        [&](std::size_t j) {
            std::vector<float> values(nx * nz);
            const auto row = [&](std::size_t k) { return ct.hu.data() + (k * ny + j) * nx; };
            for (std::size_t k = 0; k < nz; ++k) std::copy_n(row(k), nx, values.data() + k * nx);
            z.solve(values.data(), nx, nx);
            for (std::size_t k = 0; k < nz; ++k)
                std::transform(values.data() + k * nx, values.data() + (k + 1) * nx, row(k), rounded);
        },
        {}, std::size_t{4});
}

}  // namespace patient

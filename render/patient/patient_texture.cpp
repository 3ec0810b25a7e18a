#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "physics/geometry/random.h"
#include "render/patient/patient_parts.h"

namespace render {
namespace {

/// Distances at the nodes of a coarse grid, linear between them: a place costs nothing then.
class CoarseDistance {
public:
    CoarseDistance(const shape::Solid& solid, double cell) : low_(solid.box.min()), cell_(cell) {
        for (int k = 0; k < 3; ++k) size_[k] = 2 + static_cast<int>(std::ceil(solid.box.sizes()[k] / cell));
        values_.reserve(static_cast<std::size_t>(size_[0]) * size_[1] * size_[2]);
        for (int k = 0; k < size_[2]; ++k)
            for (int j = 0; j < size_[1]; ++j)
                for (int i = 0; i < size_[0]; ++i)
                    values_.push_back(static_cast<float>(solid.distance(low_ + cell * Vec3(i, j, k))));
    }
    /// Beyond the solid's box, what it is at its border.
    double operator()(const Vec3& p) const {
        const Vec3 q = (p - low_) / cell_;
        int at[3];
        double part[3];
        for (int k = 0; k < 3; ++k) {
            at[k] = std::clamp(static_cast<int>(q[k]), 0, size_[k] - 2);
            part[k] = q[k] - at[k];
        }
        double sum = 0.0;
        for (int c = 0; c < 8; ++c) {
            double weight = 1.0;
            for (int k = 0; k < 3; ++k) weight *= c >> k & 1 ? part[k] : 1.0 - part[k];
            const int x = at[0] + (c & 1), y = at[1] + (c >> 1 & 1), z = at[2] + (c >> 2);
            sum += weight * values_[(static_cast<std::size_t>(z) * size_[1] + y) * size_[0] + x];
        }
        return sum;
    }

private:
    Vec3 low_;
    double cell_;
    int size_[3];
    std::vector<float> values_;
};

}  // namespace

shape::Solid tabulated(const shape::Solid& solid, double cell) {
    return {[table = std::make_shared<const CoarseDistance>(solid, cell), box = solid.box](const Vec3& p) {
                const double beyond = box.exteriorDistance(p);
                return beyond > 0.0 ? beyond : (*table)(p);
            },
            solid.box};
}

std::vector<TextureBlob> tissue_texture(const Chance& chance, const shape::Solid& tissue) {
    // Half-axes r of smallest to largest. A blob's image has an energy ∝ fraction² · r⁴ at frequencies about
    // 1/(4r). With n(r) d(ln r) ∝ r^(−7/3) and the larger the fainter, fraction ∝ (smallest/r)^0.7, the
    // power of the sum is ∝ f^(−2.4), somewhat steeper where the smallest end.
    constexpr double smallest = 1.0, largest = 24.0, longest = 2.4;  // longest: times r, along the axis
    constexpr double filled = 0.030;  // of the place, by the texture_blobs of each factor e of r (estimate)
    constexpr double power = 7.0 / 3.0;
    const double mean_volume =
        std::numbers::pi * std::numbers::pi / 8.0 * 0.5 * (1.0 + longest) * std::pow(smallest, 3);
    const double rarest = std::pow(smallest / largest, power);
    const Vec3 low = tissue.box.min(), size = tissue.box.sizes();
    const auto count = static_cast<int>(filled / mean_volume * (1.0 - rarest) / power * size.prod());
    geometry::Random random(chance.field("texture of tissue"));
    std::vector<TextureBlob> texture_blobs;
    double balance = 0.0;
    for (int k = 0; k < count; ++k) {
        const double x = random(), y = random(), z = random();
        const Vec3 middle = low + Vec3(x, y, z).cwiseProduct(size);
        const double radius = smallest * std::pow(1.0 - random() * (1.0 - rarest), -1.0 / power),
                     elongation = random.between(1.0, longest);
        // Bundles of muscle and lobules of fat run along the body more than across it.
        const double ax = random.between(-1, 1), ay = random.between(-1, 1), az = random.between(-1.6, 1.6);
        if (tissue.distance(middle) > -0.8 * radius * elongation) continue;
        TextureBlob blob;
        blob.middle = middle.cast<float>();
        blob.axis = Vec3(ax, ay, az + (az < 0 ? -1e-6 : 1e-6)).normalized().cast<float>();
        blob.radius = static_cast<float>(radius);
        blob.elongation = static_cast<float>(elongation);
        // What is more here is less there.
        blob.fraction =
            static_cast<float>(1.15 * std::pow(smallest / radius, 0.7)) * (balance > 0.0 ? -1.0f : 1.0f);
        balance += content(blob);
        texture_blobs.push_back(blob);
    }
    return texture_blobs;
}

}  // namespace render

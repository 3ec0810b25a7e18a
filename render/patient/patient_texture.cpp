#include <algorithm>
#include <cmath>
#include <memory>

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

TexturePattern tissue_texture(const Chance& chance, const shape::Solid& tissue, const Vec3& origin) {
    const Vec3 low = tissue.box.min(), size = tissue.box.sizes();
    TexturePattern pattern;
    pattern.field = chance.field("texture of tissue");
    pattern.seed = chance.seed();
    pattern.numbers = {low.x(),  low.y(),    low.z(),    size.x(),  size.y(),
                       size.z(), origin.x(), origin.y(), origin.z()};
    pattern.choose(
        {}, [&](const TextureTry& at) { return tissue.distance(at.middle) <= -0.8 * at.radius * at.length; });
    return pattern;
}

}  // namespace render

#include "engine/patient/ct_image.h"

#include <cmath>

namespace patient {

using render::Material;
using render::VolumePart;
namespace {

/// μ of water at `ct_energy` [1/mm]: NIST Standard Reference Database 126, table 4, 0.2059 cm²/g at 60 keV
/// and 0.1837 at 80 keV, a straight line in log–log between them; 0.998 g/cm³.
double water_attenuation() {
    const double t = std::log(ct_energy / 60.0) / std::log(80.0 / 60.0);
    return 0.1 * 0.998 * 0.2059 * std::pow(0.1837 / 0.2059, t);
}

}  // namespace

double hounsfield(double attenuation) {
    const double water = water_attenuation();
    return 1000.0 * (attenuation - water) / (water - render::attenuation(Material::Air, ct_energy));
}

double hounsfield(Material material) {
    return hounsfield(render::attenuation(material, ct_energy));
}

std::vector<VolumePart> materials_of_hounsfield() {
    constexpr Material ladder[] = {Material::Lung, Material::Adipose, Material::SoftTissue,
                                   Material::CorticalBone};
    constexpr double beyond = 128;  // so many times its own number: 16 bits hold no sample outside
    std::vector<VolumePart> parts;
    for (std::size_t m = 0; m < std::size(ladder); ++m) {
        VolumePart part{ladder[m], Material::Air, {}};
        const double own = hounsfield(ladder[m]);
        // A hat over the material's own HU. Air is at −1000 by definition; below it the first line goes on.
        if (m == 0) part.knots.push_back({-1000.0 - beyond * (own + 1000.0), -beyond});
        part.knots.push_back({m == 0 ? -1000.0 : hounsfield(ladder[m - 1]), 0.0});
        part.knots.push_back({own, 1.0});
        if (m + 1 < std::size(ladder)) {
            part.knots.push_back({hounsfield(ladder[m + 1]), 0.0});
        } else {
            // Denser bone.
            part.knots.push_back({-1000.0 + beyond * (own + 1000.0), beyond});
        }
        parts.push_back(std::move(part));
    }
    return parts;
}

}  // namespace patient

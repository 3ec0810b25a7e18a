#include "engine/anatomy/tissues.h"

#include <algorithm>
#include <numbers>

namespace anatomy {
namespace {

constexpr double blood_density = 1060;  // [kg/m³]

/// A kind of vessel, by where it is in the body and how wide it is.
struct Kind {
    double support;     // force of the tissue per area of vessel and way [N/mm³]
    double wave_speed;  // of the pulse [m/s]

    /// Of a vessel of this radius [mm]: k_f = 2πR · support, as the tissue holds it all round, and
    /// E h/R = 2 ρ c² (Moens and Korteweg).
    physics::Tissue tissue(double radius) const {
        constexpr double per_pascal = 1e-6;  // [N/mm²]
        return {2 * std::numbers::pi * radius * support,
                2 * blood_density * wave_speed * wave_speed * per_pascal};
    }
};

/// Aorta, iliac and other arteries of 3.5 mm radius and more: pulse wave 6 to 8 m/s in healthy adults
/// (Reference Values for Arterial Stiffness' Collaboration, Eur Heart J 2010). Support: estimate, 5e5 Pa/m;
/// models of vessels and heart have 1e5 (cerebral arteries, VaSP), 2e5 (epicardium, Pfaller et al. 2019) to
/// 1e7 Pa/m (in tissue, Shidhore et al. 2023); the iliac arteries then have the k_f of 0.01 to 0.03 N/mm² at
/// which a soft wire leaves their bends and a Lunderquist wire straightens them.
constexpr Kind great = {5e-4, 7};
/// Muscular arteries of the limbs, the neck and the organs: pulse wave 8 to 10 m/s from carotid to radial and
/// from femoral to ankle artery; support as above.
constexpr Kind muscular = {5e-4, 9};
/// Pulse wave about 8.6 m/s in the left coronary artery (Aguado-Sierra et al. 2006); support: estimate, 1e6
/// Pa/m, above the epicardium's for they lie on muscle.
constexpr Kind coronary = {1e-3, 8.6};
/// Arteries of the head: pulse wave as of muscular arteries: estimate; support: estimate between 1e5 (VaSP)
/// and 1e7 Pa/m.
constexpr Kind cerebral = {1e-3, 9};

constexpr double great_radius = 3.5;  // [mm]

double median_radius(const CentrelineBranch& branch) {
    std::vector<double> radii = branch.radii;
    const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
    std::nth_element(radii.begin(), middle, radii.end());
    return *middle;
}

Kind kind_of(const Anatomy& anatomy, const CentrelineBranch& branch) {
    const double radius = median_radius(branch);
    if (anatomy.body && anatomy.body->landmark == geometry::Landmark::Sella) return cerebral;
    const bool heart = anatomy.body && anatomy.body->landmark == geometry::Landmark::AorticValve;
    if (radius >= great_radius) return great;
    // Of what leaves the aorta near the valve only the coronary arteries are this narrow.
    constexpr double neck_radius = 2.6;
    return heart && radius < neck_radius ? coronary : muscular;
}

}  // namespace

std::vector<physics::Tissue> tissues_of(const Anatomy& anatomy) {
    std::vector<physics::Tissue> tissues;
    for (const CentrelineBranch& branch : anatomy.branches)
        tissues.push_back(kind_of(anatomy, branch).tissue(median_radius(branch)));
    return tissues;
}

}  // namespace anatomy

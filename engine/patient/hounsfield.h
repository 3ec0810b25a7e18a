#pragma once
/// From Hounsfield units to the materials in the beam, and back.

#include <vector>

#include "render/xray/volume.h"

namespace patient {

/// Energy at which a CT's numbers hold [keV]: an estimate of the mean of a 120 kV beam behind 200 mm of soft
/// tissue. Scanners differ by some keV, which changes bone by a few per cent and soft tissue by none.
inline constexpr double ct_energy = 70;

/// Hounsfield units of a material at that energy: 1000 (μ − μ_water)/(μ_water − μ_air), not rounded.
double hounsfield(render::Material);
/// The same of any attenuation at that energy [1/mm].
double hounsfield(double attenuation);

/// Fractions of the project's materials in air by Hounsfield units, which reproduce them at `ct_energy`.
/// Between air, lung, adipose, soft tissue and cortical bone each HU is a mixture of its two neighbours, as
/// in the interpolation of W. Schneider, T. Bortfeld and W. Schlegel, Phys. Med. Biol. 45:459–478 (2000);
/// above cortical bone its density grows. Trabecular bone is a mixture of cortical bone and soft tissue
/// already. The lines go on beyond what scanners state, below air as negative fractions: samples beside an
/// edge may go beyond it, see interpolate_means.
std::vector<render::VolumePart> materials_of_hounsfield();

}  // namespace patient

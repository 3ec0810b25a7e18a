#pragma once
/// Veins behind the organs, which only the image shows.

#include <vector>

#include "engine/blood/contrast_flow.h"
#include "render/xray/fluoroscope.h"

namespace exercise {

/// Veins in which the blood of several outlets mixes, and other blood with it.
struct CollectingVein {
    std::vector<int> outlets;
    std::vector<double> fractions;  // of the vein's flow [-]
};
/// The sinuses of the head, the portal vein, the coronary sinus, the vena cava behind the kidneys.
std::vector<CollectingVein> collecting_veins(const blood::BloodFlow&);

/// Where the nodes of veins are: DistalArteries::bins for each outlet, then for each collecting vein; from
/// the organ onward.
std::uint32_t venous_nodes(const blood::BloodFlow&);
/// Concentration at them [mg/ml].
void add_venous_iodine(const blood::ContrastFlow&, std::vector<float>& iodine);

/// A tree from the tissue of every outlet, `tissue`, to a vein that leads on: of a brain in the layers over
/// its surface to the sinuses, of gut and kidneys to the portal vein and the vena cava, of a heart along the
/// groove that the circumflex artery lies in; of others beside their artery. Nodes are counted from `first`.
void add_veins(const anatomy::Anatomy&, const blood::BloodFlow&, const std::vector<render::TissueLayer>&,
               const std::vector<std::vector<geometry::Vec3>>& tissue, std::uint32_t first,
               std::vector<render::VesselPiece>&);

}  // namespace exercise

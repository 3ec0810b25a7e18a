#pragma once
/// Vessels beyond the ends of the lumen, which only the image shows.

#include <vector>

#include "engine/blood/contrast_flow.h"
#include "render/xray/fluoroscope.h"

namespace exercise {

/// Grows a tree from every outlet into the territory that it supplies, down to arteries of 0.15 mm radius:
/// the part of its layers (supplied_layers) that is nearer to it than to other outlets that supply them, or
/// the tissue ahead of the end. Branches divide the territory, radii follow Murray's law (1926) with the
/// exponent that leads from the end to the smallest arteries. A trunk goes on and fades, and so does the
/// vessel that blood comes from. Veins lead back from the same tissue: add_veins. The nodes are those of
/// distal_iodine(). The same arguments give the same pieces.
std::vector<render::VesselPiece> distal_trees(const anatomy::Anatomy&, const blood::BloodFlow&,
                                              const std::vector<render::TissueLayer>&);

/// In the lumen's cells, as the image shows it: what is given just inside an artery that begins in the image
/// reaches back to its beginning, for no catheter is seen there [mg/ml].
std::vector<float> lumen_iodine(const blood::ContrastFlow&);
/// Concentration at the nodes: those of blood::DistalArteries, then one for each source of blood, then those
/// of veins: add_venous_iodine [mg/ml].
std::vector<float> distal_iodine(const blood::ContrastFlow&);
/// How the nodes move with the lumen's, which move by `of_lumen` [mm].
std::vector<Eigen::Vector3f> distal_moves(const blood::BloodFlow&,
                                          const std::vector<Eigen::Vector3f>& of_lumen);
std::uint32_t distal_nodes(const blood::BloodFlow&);

}  // namespace exercise

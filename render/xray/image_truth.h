#pragma once
/// Ground truth of images: what each pixel's ray runs through.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "render/xray/contrast.h"
#include "render/xray/fluoroscope.h"
#include "render/xray/path_length.h"
#include "render/xray/wire_image.h"

namespace render {

/// The arm as seen from shifted objects; shift [mm].
CArm seen_from_shifted(CArm, const geometry::Vec3& shift);

/// Keeps scratch memory and the vessels of the last view; the results depend on the arguments alone. `layers`
/// have the numbers of the renderer's meshes.
class ImageTruth {
public:
    /// Pixels where the device removes more than 2 % of the softest quanta, ascending.
    std::vector<std::uint32_t> device_pixels(const CArm&, std::span<const geometry::Vec3> joints,
                                             const WireLook&);
    /// Pixels whose ray runs through a layer that takes contrast, ascending.
    const std::vector<std::uint32_t>& vessel_pixels(const CArm&, PathLengthRenderer&,
                                                    std::span<const TissueLayer>);
    /// The label of the vessel that each ray runs through longest, by labels of the nodes; 0 = none. `known`:
    /// the lengths at that arm, null if they were not made before. Throws std::invalid_argument for another
    /// number of labels than nodes.
    DeepImage vessel_labels(const CArm&, PathLengthRenderer&, std::span<const TissueLayer>,
                            const LumenContrast& vessels, const ContrastMatrix* known,
                            std::span<const std::uint16_t> of_node);

private:
    struct VesselView {
        CArm arm;
        std::vector<std::uint32_t> pixels;
        std::optional<ContrastMatrix> lengths;  // made when labels first need it
    };
    VesselView& view_of_vessels(const CArm&, PathLengthRenderer&, std::span<const TissueLayer>);

    WireImage wire_;
    std::optional<VesselView> vessels_;
};

}  // namespace render

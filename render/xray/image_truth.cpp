#include "render/xray/image_truth.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "render/xray/materials.h"

namespace render {

using geometry::Vec3;

CArm seen_from_shifted(CArm arm, const Vec3& shift) {
    arm.isocentre -= shift;
    return arm;
}

std::vector<std::uint32_t> ImageTruth::device_pixels(const CArm& arm, std::span<const Vec3> joints,
                                                     const WireLook& look) {
    static const EnergyBins bins = fit_bins(detected_spectrum(74.0));
    static const Bins blood = bins.attenuation(Material::Blood);
    std::vector<std::uint32_t> pixels;
    for (const WirePixel& pixel : wire_.cast(arm, joints, look, wire_attenuation(look, bins, blood)))
        if (pixel.transmission[0] < 0.98f) pixels.push_back(pixel.index);
    std::sort(pixels.begin(), pixels.end());
    return pixels;
}

ImageTruth::VesselView& ImageTruth::view_of_vessels(const CArm& arm, PathLengthRenderer& renderer,
                                                    std::span<const TissueLayer> layers) {
    if (vessels_ && vessels_->arm == arm) return *vessels_;
    vessels_ = VesselView{arm, {}, {}};
    Field through(arm.pixels, arm.pixels);
    for (std::size_t layer = 0; layer < layers.size(); ++layer)
        if (layers[layer].takes_contrast) renderer.accumulate(static_cast<int>(layer), arm, through);
    for (std::uint32_t i = 0; i < through.values.size(); ++i)
        if (through.values[i] > 0.0f) vessels_->pixels.push_back(i);
    return *vessels_;
}

const std::vector<std::uint32_t>& ImageTruth::vessel_pixels(const CArm& arm, PathLengthRenderer& renderer,
                                                            std::span<const TissueLayer> layers) {
    return view_of_vessels(arm, renderer, layers).pixels;
}

DeepImage ImageTruth::vessel_labels(const CArm& arm, PathLengthRenderer& renderer,
                                    std::span<const TissueLayer> layers, const LumenContrast& vessels,
                                    const ContrastMatrix* known, std::span<const std::uint16_t> of_node) {
    if (of_node.size() != vessels.nodes().size())
        throw std::invalid_argument(std::to_string(of_node.size()) + " labels for " +
                                    std::to_string(vessels.nodes().size()) + " nodes of vessels");
    DeepImage image{arm.pixels, arm.pixels,
                    std::vector<std::uint16_t>(static_cast<std::size_t>(arm.pixels) * arm.pixels, 0)};
    VesselView& view = view_of_vessels(arm, renderer, layers);
    if (!view.lengths) view.lengths = known ? *known : vessels.at(arm);
    const std::vector<std::uint16_t> labels = longest_label(*view.lengths, of_node);
    for (std::size_t row = 0; row < labels.size(); ++row)
        image.pixels[view.lengths->pixels[row]] = labels[row];
    return image;
}

}  // namespace render

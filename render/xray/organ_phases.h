#pragma once
/// Organs that move with breath and heartbeat: at one pose a few phases are drawn, images between are
/// blended.

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "render/xray/beam_images.h"
#include "render/xray/path_length.h"

namespace render {

/// What phases are drawn from. `layers` have the numbers of the renderer's meshes.
struct PosedLayers {
    PathLengthRenderer& renderer;
    std::span<const TissueLayer> layers;
    const PoseImages& pose;
};

/// What a phase of breath or heartbeat changes of a pose.
struct MovedLengths {
    std::vector<Field> changes;          // of each mixture [mm]; empty where nothing moves
    std::map<int, SparseLength> organs;  // through each perfused layer that moves
};

/// What moved organs add to the exponents of a beam at rest: to every bin of every pixel.
class MovedExponents {
public:
    /// Pixels are kept in blocks, row by row, so that a frame passes over those that do not move.
    static constexpr std::size_t block = 64;

    MovedExponents(const MovedLengths&, const PoseImages&, const EnergyBins&);
    /// Those of a block, bins of a pixel side by side; null where nothing moves.
    const float* of_block(std::size_t number) const {
        return starts_[number] < 0 ? nullptr : values_.data() + starts_[number];
    }

private:
    std::vector<std::int64_t> starts_;  // of each block in `values_`; −1 = nothing moves there
    std::vector<float> values_;
};

/// The organs at a moment: a blend of phases. Valid as long as the phases are.
class OrganMoment {
public:
    bool at_rest() const { return parts_.empty(); }
    void add(float weight, const MovedExponents& there) { parts_.push_back({weight, &there}); }
    /// Adds what moved in a block to the exponents of its pixels; false where nothing did. They may be fewer
    /// than a block at the end of an image.
    bool add_to_block(std::size_t number, std::span<float> exponents) const;
    /// The same for some pixels.
    void add_to(std::span<const std::uint32_t> pixels, std::span<float> exponents) const;

private:
    struct Part {
        float weight;
        const MovedExponents* there;
    };
    std::vector<Part> parts_;
};

/// The phases of one pose, drawn when first needed. Their images do not depend on when that was.
class OrganPhases {
public:
    explicit OrganPhases(std::span<const TissueLayer>);

    /// Forgets everything: the pose has changed.
    void clear();

    /// A phase, and its weight in the blend; none of those at rest.
    struct Part {
        int phase;
        double weight;
    };
    std::vector<Part> parts(const Exposure&) const;
    const MovedLengths& lengths(int phase, const PosedLayers&);
    /// `beam`: of the exposure's voltage, which is the only one of the exposure's values besides its phases
    /// that counts.
    OrganMoment moment(const Exposure&, const BeamImages& beam, const PosedLayers&);

    /// Draws one layer of a phase that will soon be needed, or makes its exponents; false when all is there.
    bool draw_ahead(const Exposure&, const BeamImages& beam, const PosedLayers&);

private:
    enum Mover { Breath, Beat, Drift };
    static constexpr int movers = 3;
    /// Phases of each besides rest, which is 0; the heart's follow the breath's, and so on.
    static constexpr std::array<int, movers> counts = {4, 3, 2};
    static int first_of(int mover);
    static Mover mover_of(int phase);
    /// Lengths of the layers that a mover moves, drawn layer by layer.
    struct Drawing {
        std::vector<Field> sums;             // of each mixture [mm]; empty where no layer belongs to it
        std::map<int, SparseLength> organs;  // through each perfused layer
        std::size_t next = 0;                // index in layers_
    };
    bool draw_layer(Drawing&, Mover, PathLengthRenderer::Phase, const PosedLayers&);
    Drawing& rest(Mover);
    static PathLengthRenderer::Phase place_of(int phase);
    const MovedExponents& exponents(int phase, const Exposure&, const BeamImages&, const PosedLayers&);

    std::array<std::vector<int>, movers> layers_;  // that each moves and that can be seen
    std::array<std::optional<Drawing>, movers> rest_;
    std::map<int, Drawing> begun_;
    std::map<int, MovedLengths> lengths_;                         // by phase
    std::map<std::pair<double, int>, MovedExponents> exponents_;  // by requested voltage and phase
};

}  // namespace render

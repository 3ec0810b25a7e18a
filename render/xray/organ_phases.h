#pragma once
/// Organs that move with breath, heartbeat and bowel: at one pose a few phases are drawn. Between them the
/// nearest phase is carried to where its organs are (OrganFlow).

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "render/xray/beam_images.h"
#include "render/xray/c_arm.h"
#include "render/xray/fluoroscope.h"
#include "render/xray/path_length.h"

namespace render {

/// Displacements of layers in the image of an arm: at each node of a coarse grid, those of what is seen
/// edge-on there, for outlines are what moves visibly. Between outlines they are continued smoothly.
class OrganFlow {
public:
    /// What moves, sampled on the surfaces of layers; kept, for meshes are not.
    class Samples {
    public:
        void add(const TissueLayer&);

    private:
        friend class OrganFlow;
        struct Sample {
            Eigen::Vector3f place, normal;              // [mm], unit
            std::array<Eigen::Vector3f, movers> moves;  // [mm]
            float weight;                               // of its outline
        };
        std::vector<Sample> samples_;
    };

    OrganFlow(const Samples&, const CArm&);

    using Flows = std::array<Eigen::Vector2f, movers>;  // by a whole fraction of each mover [pixels]
    /// For each node the flows of what is seen there at these fractions; 0 at nodes farther than a cell from
    /// the box.
    struct Box {
        int left, top, right, bottom;  // the last two exclusive [pixels]
    };
    std::vector<Flows> at_fractions(const MoverFractions&, const Box&) const;
    /// Most that anything moves for a change of the fractions by these steps, in either direction [pixels].
    double farthest(const MoverFractions& steps) const;

    /// Node (i, j) is at pixel ((i − margin) · cell, (j − margin) · cell).
    static constexpr int side = 41, margin = 4;
    float cell() const { return cell_; }  // [pixels]

private:
    Flows at(float x, float y) const;

    float cell_;
    std::vector<Flows> nodes_;
};

/// What phases are drawn from. `layers` have the numbers of the renderer's meshes.
struct PosedLayers {
    PathLengthRenderer& renderer;
    std::span<const TissueLayer> layers;
    const PoseImages& pose;
};

/// A part of an image that may reach beyond its edges; nothing is seen outside it.
template <class Value>
struct WindowImage {
    int left = 0, top = 0, width = 0, height = 0;  // [pixels]
    std::vector<Value> values;                     // row by row
};

/// A vector of the bins of a pixel.
using FourBins = float __attribute__((vector_size(energy_bins * sizeof(float))));

/// The organs at a moment. Valid as long as the phases are.
class OrganMoment {
public:
    bool at_rest() const { return groups_.empty(); }
    /// The beam without the organs that move, unless all are at rest: per pixel and bin, as
    /// BeamImages::primary.
    const std::vector<PixelBins>& still() const { return *still_; }
    /// Multiplies the transmission of a row's pixels by that of moving organs; from which pixel on, and up to
    /// which, there are any.
    std::pair<int, int> dim_row(int row, std::span<FourBins> transmission) const;
    /// The same for some pixels of an image `width` pixels wide, bins side by side.
    void dim(std::span<const std::uint32_t> pixels, int width, std::span<float> transmission) const;
    /// Adds `concentration` times the length through a perfused layer that moves, and notes the pixels that
    /// had none; false for a layer that does not move.
    bool dissolve_in(int layer, float concentration, Field& iodine, std::vector<std::uint32_t>& pixels) const;

private:
    friend class OrganPhases;
    /// Layers that are drawn together, at the phase nearest to the moment.
    struct Group {
        const WindowImage<FourBins>* transmission = nullptr;
        std::map<int, const WindowImage<float>*> organs = {};
        std::vector<Eigen::Vector2f> displacement = {};  // of each node of the flow; to the phase [pixels]
        float cell = 0;
        int reach = 0;  // how far organs may be from their places in the phase [pixels]
    };
    template <class Value, class Add>
    static void for_each(const Group&, const WindowImage<Value>&, int row, int first, int end, const Add&);

    const std::vector<PixelBins>* still_ = nullptr;
    std::vector<Group> groups_;
};

/// The phases of one pose, drawn when first needed. Their images do not depend on when that was.
class OrganPhases {
public:
    /// Their meshes need not be kept.
    explicit OrganPhases(std::span<const TissueLayer>);

    /// Forgets everything: the pose has changed.
    void clear();
    /// Forgets the images, and keeps what they are made from: only the beam has changed.
    void beam_changes();

    /// `beam`: of the exposure's voltage, which is the only one of the exposure's values besides its phases
    /// that counts.
    OrganMoment moment(const Exposure&, const BeamImages& beam, const PosedLayers&);

    /// Draws one layer of a phase that will soon be needed, or makes its image; false when all is there.
    bool draw_ahead(const Exposure&, const BeamImages& beam, const PosedLayers&);

private:
    /// How often each mover's way is divided; phases are a grid of shares.
    static constexpr std::array<int, movers> steps = {3, 3, 4};
    using Place = std::array<int, movers>;  // a phase, in steps
    /// Path lengths of a group's layers.
    struct Drawing {
        std::vector<Field> sums;                   // of each mixture [mm]; empty where no layer belongs to it
        std::map<int, WindowImage<float>> organs;  // through each perfused layer [mm]
        std::size_t next = 0;                      // index in the list of layers
    };
    /// Layers that the same movers move, of a group.
    struct Kind {
        std::array<bool, movers> moved;
        std::vector<int> layers;
        std::map<Place, Drawing> drawings = {};
    };
    struct Group {
        std::array<bool, movers> moved = {};  // by any of its kinds
        std::vector<Kind> kinds = {};
        std::shared_ptr<const OrganFlow::Samples> samples = {};
        // Of the pose.
        std::optional<OrganFlow> flow = {};
        CArm arm = {};   // wider than that of the pose by `margin` pixels on each side
        int margin = 0;  // [pixels]
        std::map<std::pair<double, Place>, WindowImage<FourBins>> images = {};  // by requested voltage
    };
    static Place nearest(const Group&, const MoverFractions&);
    static MoverFractions fractions_of(const Place&);
    static void prepare(Group&, const PosedLayers&);
    bool draw_layer(Group&, Kind&, const Place&, const PosedLayers&);
    static Place of_kind(const Kind&, Place);
    /// The transmission of the group's layers in a phase.
    const WindowImage<FourBins>& image(Group&, const Place&, const Exposure&, const BeamImages&,
                                       const PosedLayers&);

    const std::vector<PixelBins>& still(const Exposure&, const BeamImages&, const PosedLayers&);

    std::vector<Group> groups_;
    std::map<double, std::vector<PixelBins>> still_;  // by requested voltage
};

}  // namespace render

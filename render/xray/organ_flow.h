#pragma once
/// How the images of organs move with breath, heartbeat and bowel.

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "render/xray/c_arm.h"
#include "render/xray/fluoroscope.h"

namespace render {

enum Mover { Breath, Beat, Drift };
inline constexpr int movers = 3;
/// Of each mover the share of its displacements, 0 to 1.
using MoverShares = std::array<double, movers>;

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

    using Flows = std::array<Eigen::Vector2f, movers>;  // by a whole share of each mover [pixels]
    /// For each node the flows of what is seen there at these shares; 0 at nodes farther than a cell from the
    /// box.
    struct Box {
        int left, top, right, bottom;  // the last two exclusive [pixels]
    };
    std::vector<Flows> at_shares(const MoverShares&, const Box&) const;
    /// Most that anything moves for a change of the shares by these steps, in either direction [pixels].
    double farthest(const MoverShares& steps) const;

    /// Node (i, j) is at pixel ((i − margin) · cell, (j − margin) · cell).
    static constexpr int side = 41, margin = 4;
    float cell() const { return cell_; }  // [pixels]

private:
    Flows at(float x, float y) const;

    float cell_;
    std::vector<Flows> nodes_;
};

}  // namespace render

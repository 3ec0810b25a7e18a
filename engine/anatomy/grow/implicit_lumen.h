#pragma once
/// The lumen of a vessel tree as the zero level of a smooth function.

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "engine/anatomy/grow/vessel_tree.h"

namespace anatomy {

/// f < 0 inside. A branch is the envelope of balls along its centreline: f is the distance to it. A child is
/// joined to the union that its parent belongs to by a cubic smooth minimum. Its width is 0.8 of the child's
/// radius where it leaves the parent, until their walls are well apart, and fades to zero within three more
/// radii, so that vessels that pass each other stay apart; likewise where a branch ends on another. Every
/// open end is extended straight and closes in a ball.
class ImplicitLumen {
public:
    static constexpr int block_cells = 8;  // along an edge of a block

    /// `cell` is the cell size of the grid of blocks [mm].
    ImplicitLumen(const VesselTree&, double cell);

    struct Value {
        double distance = 0;                               // f [mm]
        geometry::Vec3 gradient = geometry::Vec3::Zero();  // of f
        double radius = 0;                                 // of the branch nearby [mm]
        double place = 0;                                  // along that branch, in samples
    };
    Value at(const geometry::Vec3&) const;
    /// The same at a point inside or on the border of the block with that index.
    Value at(const geometry::Vec3&, int block) const;

    /// The point moved to f = 0 along the gradient. Points farther than a cell from f = 0 may not arrive
    /// there.
    geometry::Vec3 projected(const geometry::Vec3& x) const { return foot(x).point; }
    struct Foot {
        geometry::Vec3 point;  // the projected one
        Value value;           // there
    };
    Foot foot(const geometry::Vec3&) const;
    /// f changes by no more than this factor times the distance moved.
    static constexpr double steepest = 1.2;

    using Block = std::array<int, 3>;  // its first cell divided by block_cells
    /// The blocks that hold every cell the surface passes through, in order.
    std::span<const Block> blocks() const { return blocks_; }
    int find(const Block&) const;  // index, −1 when the surface is not nearby
    double cell() const { return cell_; }
    geometry::Vec3 node(const Block&, int x, int y, int z) const;  // of the block's grid [mm]

    /// Where an open end's extension closes [mm].
    geometry::Vec3 beyond_end(int branch, bool start) const;

private:
    struct Limb {                                  // a branch with its extensions
        geometry::Polyline points, tangents;       // tangents per sample step
        std::vector<double> radii, radius_slopes;  // slopes per sample step
        struct Junction {                          // with the parent, or with a branch that it joins
            geometry::Vec3 place = geometry::Vec3::Zero();
            double blend = 0;           // width of the smooth minimum [mm]
            double full = 0, none = 0;  // full blend up to this far, none beyond the other [mm]
        };
        std::vector<Junction> junctions;
        double blend = 0;  // widest smooth minimum [mm]; 0 without junctions
        double dip = 0;    // most by which a ball between samples comes nearer than theirs [mm]
        struct Group {     // of consecutive samples
            int first, last, middle;
            double reach;  // their balls lie within this of the middle one's centre [mm]
        };
        std::vector<Group> groups;
        struct Four {  // samples in single precision, from the origin; those past the last are far away
            Eigen::Array4f x, y, z, radius;
        };
        std::vector<Four> fours;
        geometry::Vec3 origin = geometry::Vec3::Zero();
        double extent = 0;  // of the samples, from the origin [mm]
    };
    struct Run {  // of samples that may hold the nearest ball of a limb
        int limb, first, last;
        int guess;  // a sample of this or another run of the limb that is likely to hold it
    };
    struct Near {  // the nearest ball among a limb's samples
        int limb = -1, sample = -1;
        double distance = 0;  // [mm]
    };
    void search(const Run&, const geometry::Vec3&, Near&) const;
    double ball_distance(const Limb&, int sample, const geometry::Vec3&) const;
    Value limb_value(const Limb&, int sample, const geometry::Vec3&) const;
    Value evaluate(const geometry::Vec3&, std::span<const Run>) const;
    void unite(Value& united, const Value& of_limb, const Limb&, const geometry::Vec3&) const;
    void make_blocks();
    void collect_runs(const geometry::Vec3& centre, double reach, std::vector<Run>&) const;

    std::vector<Limb> limbs_;
    double cell_ = 0;
    std::vector<Block> blocks_;
    std::unordered_map<std::uint64_t, int> index_;
    std::vector<Run> runs_, all_;
    std::vector<int> first_run_;  // per block, and the end
};

}  // namespace anatomy

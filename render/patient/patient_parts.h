#pragma once
/// The pieces that make up a patient, all in the body frame (body.h). For patient*.cpp only.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "render/patient/body.h"
#include "render/patient/patient.h"
#include "render/patient/signed_distance.h"
#include "render/patient/solids.h"
#include "render/patient/texture_pattern.h"

namespace render {

/// Random numbers of a patient, each from a stream named after its quantity, so that a new one changes no
/// other. Seed 0 gives means.
class Chance {
public:
    explicit Chance(std::uint64_t seed) : seed_(seed) {}
    bool varied() const { return seed_ != 0; }
    std::uint64_t seed() const { return seed_; }
    /// Of mean 0 and standard deviation 1, never beyond ±2.5.
    double normal(std::string_view quantity, int index = 0) const;
    /// Seed of a field of noise: patients of different seeds have different texture, also seed 0 has one.
    std::uint64_t field(std::string_view quantity, int index = 0) const;

private:
    std::uint64_t seed_;
};

/// No half of a body is the mirror image of the other: how far what lies here is off the place that it has in
/// a symmetrical one [mm]. The midline, with spine, heart and great vessels, stays.
class Askew {
public:
    explicit Askew(const Chance&);
    geometry::Vec3 operator()(const geometry::Vec3&) const;

private:
    bool varied_;
    std::array<std::uint64_t, 3> fields_;
};

/// Bone: the outer surface of the cortical shell, the marrow within, and trabeculae that stand out or are
/// missing, as more or less of cortical bone.
struct Bones {
    geometry::TriangleMesh outer;  // in the order of geometry::ordered()
    geometry::TriangleMesh core;
    geometry::TriangleMesh canals;  // of long bones, with yellow marrow
    std::vector<TextureBlob> trabeculae;
    std::vector<TexturePattern> patterns;  // of `outer`

    /// `plaques`: how much of the cortex add_plaques draws [mm].
    void add(const shape::Surfaces&, const Eigen::Isometry3d& place = Eigen::Isometry3d::Identity(),
             double plaques = shape::thinner_by);
    /// The same surfaces mirrored in the plane x = 0, then placed.
    void add_mirrored(const shape::Surfaces&, const Eigen::Isometry3d& place = Eigen::Isometry3d::Identity(),
                      double plaques = shape::thinner_by);
    /// The canal of a long bone along its middle line.
    void add_canal(const std::vector<shape::Station>&, std::uint64_t field, const Eigen::Isometry3d& place,
                   bool mirror);
    /// Marrow with less bone than its mean, as in the middle of a vertebral body: an ellipsoid of revolution
    /// about `axis` with half-axes `along` and `across`, emptier by `by` of the place in its middle.
    void add_poor_marrow(const geometry::Vec3& middle, const geometry::Vec3& axis, double along,
                         double across, double by);
    /// Places in the marrow of the solid that was added last which are denser or emptier than its mean,
    /// `per_area` tries for each mm² of its surface, down to `deepest` mm, from 0.5 mm to `coarsest` in
    /// half-axis: large ones are rare, so that texture has all scales. Thin ones are long and run the way of
    /// `along`: the longer that is, the more of them do. `place` moves them.
    void add_grain(const shape::Compound&, double per_area, double deepest, double coarsest,
                   const geometry::Vec3& along, std::uint64_t field,
                   const Eigen::Isometry3d& place = Eigen::Isometry3d::Identity(), bool mirror = false);
    void add_trabecula(const geometry::Vec3& from, const geometry::Vec3& to, double radius);
    /// The outer part of the cortex, which meshes leave out (shape::polygonised): plaques of bone about the
    /// surface, as many here and there as chance has it, so that no wall is a line of one width and density.
    void add_plaques(std::uint64_t field);

private:
    struct Added {
        std::size_t from, to;  // triangles of `outer`
        double plaques;        // [mm]
    };
    std::vector<Added> added_;
    double balance_ = 0.0;  // of the bone in trabeculae that no grain makes up for yet [mm³]
};

/// A piece that is drawn once for each side: `at` mirrors x for the right one.
struct Side {
    double sign;  // +1 left, −1 right
    geometry::Vec3 at(double x, double y, double z) const { return {sign * x, y, z}; }
};
constexpr Side left{1.0}, right{-1.0};

/// Linear interpolation between the rows of a table of {height, value}.
template <std::size_t N>
double interpolated(const double (&rows)[N][2], double at) {
    std::size_t i = 1;
    while (i + 1 < N && at > rows[i][0]) ++i;
    const double t = std::clamp((at - rows[i - 1][0]) / (rows[i][0] - rows[i - 1][0]), 0.0, 1.0);
    return rows[i - 1][1] + t * (rows[i][1] - rows[i - 1][1]);
}

/// Adds the vertebrae whose middle lies between two heights, with the sacrum if these reach below L5.
void add_spine(Bones&, const Chance&, double low, double high);
/// The sacrum as one solid, from which hip bones stay clear.
shape::Compound sacrum();
/// Hip bones and femora; these end at height `low`.
void add_pelvis(Bones&, const Chance&, double low);

/// The inside of the rib cage at a height: a superellipse.
struct CageSection {
    double half_width, half_depth, middle;  // middle: its y [mm]
    static constexpr double exponent = 2.3;

    /// At `angle` from the back (0) around the left side to the front (π), `outward` mm off the pleura.
    geometry::Vec3 point(double angle, double z, double outward) const;
    bool holds(double x, double y, double inset = 0.0) const;
};

/// The position of the front of the chest, and the vessels that its lungs leave room for.
struct Chest {
    double front;  // y of the skin in front of the sternum [mm]
    const std::vector<VesselSample>& vessels;
    bool arms_down = false;  // beside the trunk; else held out to the sides

    CageSection section(double z) const;
};
/// Ribs and sternum, with the shoulders if asked for.
void add_cage(Bones&, const Chest&, const Chance&, bool shoulders = true);
/// Middle of the left humerus' head, and the direction of that bone.
geometry::Vec3 shoulder_joint(const Chest&);
geometry::Vec3 arm_direction(const Chest&);
void add_chest_layers(std::vector<TissueLayer>&, const Chest&, const Chance&);

/// The space of a lung, before heart and vessels take room from it.
shape::Solid lung_space(const Chest&, Side);

/// TextureBlobs of more and of less tissue, as many mm³ of each, in a solid: what fat between and in muscles,
/// fasciae and the walls and contents of bowels do to an image. Their power in it falls as 1/f³ (of
/// mammograms: about that, Burgess 2001).
TexturePattern tissue_texture(const Chance&, const shape::Solid& tissue, const geometry::Vec3& origin);

/// The same distances at the nodes of a grid, linear between them: a place costs nothing then.
shape::Solid tabulated(const shape::Solid&, double cell);

/// The skin; septa and creases in the fat under it; fat between the muscles and in them. `body`: what the
/// skin encloses; `tissue`: flesh without lungs and brain; `front`: y of the belly's skin. The first two
/// layers are the body's and its flesh's.
void add_skin_and_muscles(std::vector<TissueLayer>&, const Chance&, const shape::Solid& body,
                          const shape::Solid& tissue, const Chest&, double front);

/// `flesh`: what is under the fat of the skin; `cavity`: what the muscles of belly, back and pelvis enclose;
/// `front`: y of the skin in front of it.
void add_abdomen_layers(std::vector<TissueLayer>&, const Chance&, const shape::Solid& flesh,
                        const shape::Solid& cavity, double front, bool bowel_gas);

/// The head. All places in it are measured from the sella. Skull 180 mm long and 146 wide (men: 182 and 145,
/// texts); sella to nasion 72, sella to basion 46, nasion to chin 118 (cephalometric means of men, rounded:
/// Riolo 1974).
Eigen::Isometry3d at_sella();
inline const geometry::Vec3 vault(0.0, 20.0, 28.0);  // middle of the skull's vault [mm]
constexpr double sinus_wall = 0.55;                  // thin bone around air [mm]
/// What the tables of the skull enclose.
shape::Solid cranial_cavity(const Chance&);
double skull_thickness(const geometry::Vec3&);
/// Air of the nose's cells and of the ears: closed spaces with thin walls.
shape::Compound sinuses(const Chance&);
/// How far the septum of the nose stands off the midline, to the left [mm]: in most people it is bent.
std::function<double(const geometry::Vec3&)> septum_bend(const Chance&);

/// The kidney along `course`, from above to below, with its cortex and medulla: the first is the whole in its
/// fat, the others are what contrast dissolves in, and make it up.
void add_kidney_layers(std::vector<TissueLayer>&, const Chance&, Side,
                       const std::vector<shape::Station>& course);

void add_head_bones(Bones&, const Chance&);
/// The brain and, in the same place, the territories of its arteries, which make it up. `brain` and its
/// distances are measured from the sella; `place` moves them into the body.
void add_brain_layers(std::vector<TissueLayer>&, const Chance&, const shape::Solid& brain,
                      const Eigen::Isometry3d& place);
void add_head_layers(std::vector<TissueLayer>&, const Chance&);

}  // namespace render

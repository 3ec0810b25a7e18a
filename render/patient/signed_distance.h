#pragma once
/// Solids given by their signed distance, and the closed meshes of what they make up together.
///
/// A distance is negative inside. It need only be right near the surface: farther away, its sign and order of
/// magnitude are enough.

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <vector>

#include "physics/geometry/vec.h"

namespace render::shape {

/// How much thinner than asked for the shells of rough solids are in their meshes, as a rule: the rest is
/// drawn otherwise, softer (Bones::add_plaques) [mm].
constexpr double thinner_by = 0.62;

struct Solid {
    std::function<double(const geometry::Vec3&)> distance;  // [mm]
    Eigen::AlignedBox3d box;                                // that holds it
};

/// Half-axes along the columns of `axes` [mm].
Solid ellipsoid(const geometry::Vec3& centre, const geometry::Vec3& half_axes,
                const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity());
Solid ball(const geometry::Vec3& centre, double radius);
/// A round cone: balls of linearly changing radius along a segment.
Solid cone(const geometry::Vec3& from, const geometry::Vec3& to, double radius_from, double radius_to);
/// A box with rounded edges; `half` includes the rounding.
Solid block(const geometry::Vec3& centre, const geometry::Vec3& half, double rounding,
            const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity());
/// All points p with normal·(p − at) < 0.
Solid half_space(const geometry::Vec3& at, const geometry::Vec3& normal);

/// A point of a path and the half-axes of the (super)elliptic section there [mm].
struct Station {
    geometry::Vec3 at;
    double a, b;
};
/// Sections along a smooth curve through the stations, with round ends; `u` is the direction of half-axis a,
/// made perpendicular to the curve. `exponent` 2 is an ellipse, larger is boxier. `inset` draws the surface
/// inward by mm that depend on the length along the curve [mm] and the angle around it from u [rad].
Solid sweep(const std::vector<Station>&, const geometry::Vec3& u, double exponent = 2.0,
            std::function<double(double, double)> inset = {});

/// A sheet cut at one height: points x, y and half thickness there [mm].
struct Cut {
    double z;
    std::vector<geometry::Vec3> points;
};
/// A sheet through cuts in ascending order of z, all of one number of points.
Solid sheet(std::vector<Cut>);

/// The same solid out of shape: its places wander by some `by` mm at a wavelength [mm].
Solid warped(Solid, double by, double wavelength, std::uint64_t field);
/// The same solid, its distance smaller by `by` [mm].
Solid grown(Solid, double by);
Solid moved(Solid, const Eigen::Isometry3d&);

/// A sum of solids, joined, cut and limited in the order of the calls. Edges are rounded over `blend` mm.
/// `shell` is the thickness of the hard layer under the surface of a part [mm].
class Compound {
public:
    using Shell = std::function<double(const geometry::Vec3&)>;

    Compound& add(Solid, double shell = 0.0, double blend = 0.0);
    /// The shell varies from place to place, up to `thickest`.
    Compound& add(Solid, Shell shell, double thickest, double blend);
    Compound& cut(Solid, double blend = 0.0);
    Compound& keep(Solid, double blend = 0.0);
    /// What no drawn shape has: the surface wanders by some `contour` mm at wavelengths of 6 to 15 mm, and
    /// the shell under it is uneven: 0.45 to 1.55 times as thick from place to place, and by `rough` mm at 3
    /// to 10 mm. `field` names the noise. The mesh of the shell is thinner by `thinner` mm.
    void roughen(double contour, double rough, std::uint64_t field, double thinner = thinner_by);
    /// Cuts every part that was added to another compound, grown by `gap` mm: a joint space.
    Compound& clear_of(const Compound&, double gap);
    /// Every added part grown by `by` mm.
    Compound grown_by(double by) const;

    bool empty() const { return parts_.empty(); }
    const Eigen::AlignedBox3d& box() const { return box_; }

    struct Value {
        double distance, shell;  // [mm]
    };
    /// Of the parts listed, which are those near p; of all of them by default.
    Value at(const geometry::Vec3& p) const { return at(p, all_); }
    Value at(const geometry::Vec3& p, const std::vector<std::uint16_t>& parts) const;
    /// Parts whose surface may matter in a box.
    std::vector<std::uint16_t> parts_near(const Eigen::AlignedBox3d&, double margin) const;
    /// How thick the shell's mesh is where the whole is `shell` mm.
    double uneven_shell(const geometry::Vec3& p, double shell) const;
    bool is_rough() const { return contour_ > 0.0; }
    /// Upper bounds [mm].
    double widest_blend() const { return widest_blend_; }
    double thickest_shell() const { return thickest_shell_; }
    double widest_contour() const { return 1.8 * contour_; }

    /// The whole as one solid.
    Solid solid() const;

private:
    enum class Operation { Add, Cut, Keep };
    struct Part {
        Solid solid;
        Operation operation;
        double blend, shell;
        Shell varying;
    };
    void push(Part);

    std::vector<Part> parts_;
    std::vector<std::uint16_t> all_;
    Eigen::AlignedBox3d box_;
    double contour_ = 0.0, rough_ = 0.0, thinner_ = 0.0;
    std::uint64_t field_ = 0;
    double widest_blend_ = 0.0, thickest_shell_ = 0.0;
};

struct Surfaces {
    geometry::TriangleMesh outer, core;  // core: within the shell
};

/// Closed meshes of the compound's surface and of the one under its shell, by naive surface nets on a grid of
/// `cell` mm. A surface that crosses one cell twice touches itself there; every ray still enters as often as
/// it leaves, because the meshes follow from the signs at the nodes alone. Vertices of neighbouring cells are
/// merged where the surface is nearly flat; that keeps the balance, for it maps matched edges to matched
/// ones. The core is empty when all shells are 0.
Surfaces polygonised(const Compound&, double cell);

/// Smooth random numbers in space, about −1 to 1, of a wavelength [mm]; `seed` names the field.
double noise(const geometry::Vec3& p, double wavelength, std::uint64_t seed);
/// Several octaves of it, amplitudes proportional to the wavelength to the power `rise`, down to `finest` mm.
double fractal(const geometry::Vec3& p, double coarsest, double finest, double rise, std::uint64_t seed);

}  // namespace render::shape

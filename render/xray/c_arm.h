#pragma once
/// Geometry of the C-arm: positions of source and detector, and where a point appears on the image.
///
/// Angles as in DICOM (0018,1510) and (0018,1511): LAO and cranial positive. LAO 30° puts the detector over
/// the patient's left. The image faces the patient: the patient's left on the viewer's right, head up.

#include <string>
#include <vector>

#include "physics/geometry/state.h"
#include "physics/geometry/vec.h"

namespace render {

using geometry::Polyline;
using geometry::TriangleMesh;
using geometry::Vec3;

inline constexpr double widest_opening = 1000;  // of the collimator: open [mm]

/// A plate of copper at the tube that can be moved into the beam and turned. Its edge is thin, and it becomes
/// thicker with the distance from it.
struct BeamFilter {
    double edge = widest_opening;  // from the image's middle, at the detector; negative: past it [mm]
    double angle = 0.0;  // of the covered side in the image, from the viewer's right counter-clockwise [rad]

    bool is_in() const { return edge < widest_opening; }
    bool operator==(const BeamFilter&) const = default;
};

struct CArm {
    double lao = 0.0;                                   // RAO negative [rad]
    double cranial = 0.0;                               // caudal negative [rad]
    double sid = 1100.0;                                // source to detector [mm]
    double sod = 750.0;                                 // source to isocentre [mm]
    geometry::Vec3 isocentre = geometry::Vec3::Zero();  // in patient coordinates [mm]
    double detector_width = 300.0;                      // of the square field, smaller when magnified [mm]
    /// Opening of the collimator at the detector [mm]; it opens no wider than the field.
    double opening_width = widest_opening;
    double opening_height = widest_opening;
    BeamFilter wedge = {};         // with a straight edge
    BeamFilter lung_shutter = {};  // with the edge of a circle, which leaves the heart open
    int pixels = 512;              // along either side

    void state(geometry::StateStream&);
};

bool operator==(const CArm&, const CArm&);
/// Whether the two differ at most by collimator and filters.
bool same_pose(const CArm&, const CArm&);

/// The range of an angiography stand; files and commands that exceed it are rejected.
struct ArmLimits {
    struct Range {
        double least, most;
    };
    static constexpr Range lao = {-120, 120};           // [deg]
    static constexpr Range cranial = {-45, 45};         // [deg]
    static constexpr Range sid = {500, 2000};           // [mm]
    static constexpr Range sod = {300, 1500};           // [mm]
    static constexpr Range detector_width = {20, 600};  // [mm]
    static constexpr double isocentre = 1e4;            // of each coordinate, in either direction [mm]
};

/// Everything that makes the C-arm unusable, one sentence each; empty when it can be exposed. Of the limits
/// above only those of the angles apply: distances need only make a picture.
std::vector<std::string> problems(const CArm&);

/// Directions of the detector in patient coordinates, unit and mutually orthogonal.
struct ArmAxes {
    geometry::Vec3 beam;   // from the source to the detector
    geometry::Vec3 right;  // along a row, to the viewer's right
    geometry::Vec3 up;     // along a column, to the top of the image
};
ArmAxes axes(const CArm&);

geometry::Vec3 source(const CArm&);  // focal spot [mm]
double pixel_width(const CArm&);     // on the detector [mm]
/// Edges in pixels from the image's left and top.
struct PixelBox {
    double left, top, right, bottom;
};
PixelBox opening_of(const CArm&);  // the part of the image that the collimator leaves open
double open_area(const CArm&);     // of the detector, left open by the collimator [mm²]

/// The image of a point. Pixel (i, j) covers [i, i+1) × [j, j+1), j downward from the top.
struct Pixel {
    double x = 0.0;
    double y = 0.0;
    double depth = 0.0;  // along the beam axis from the source [mm]; unless positive, x and y are meaningless
};
Pixel project(const CArm&, const geometry::Vec3& point);

/// P of (x·w, y·w, w) = P·(point, 1), consistent with project; w is the depth.
Eigen::Matrix<double, 3, 4> camera_matrix(const CArm&);

/// From the source toward the place (x, y) of the image, unit.
geometry::Vec3 ray_direction(const CArm&, double x, double y);

}  // namespace render

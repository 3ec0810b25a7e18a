#include "engine/anatomy/import/file_frame.h"

#include <Eigen/Geometry>
#include <cmath>

#include "engine/io/error.h"
#include "engine/io/text.h"

namespace anatomy {
namespace {

using geometry::Mat3;
using geometry::Vec3;

Mat3 rotation(const std::string& text) {
    constexpr double none = 1e9;
    const double degrees = text.size() > 2 && text[1] == ':'
                               ? io::parse_number(std::string_view(text).substr(2)).value_or(none)
                               : none;
    const auto axis = std::string_view("xyz").find(text.empty() ? ' ' : text[0]);
    if (axis == std::string_view::npos || !(std::abs(degrees) <= 360))
        throw io::InputError(
            "--rotate: '{}' was found; AXIS:DEG such as z:90 is accepted, x, y or z and -360 to 360",
            text.substr(0, 40));
    // Quarter turns are exact.
    const double quarters = degrees / 90;
    Mat3 turn =
        Eigen::AngleAxisd(degrees * geometry::degree, Vec3::Unit(static_cast<int>(axis))).toRotationMatrix();
    if (quarters == std::round(quarters)) turn = turn.array().round().matrix();
    return turn;
}

}  // namespace

Mat3 to_patient(const FileFrame& frame) {
    if (!(frame.scale >= 1e-6 && frame.scale <= 1e6))
        throw io::InputError("--scale: {} was found; 1e-6 to 1e6 is accepted", frame.scale);
    if (frame.axes != "lps" && frame.axes != "ras")
        throw io::InputError("--axes: '{}' was found; lps or ras is accepted", frame.axes.substr(0, 40));
    Mat3 matrix = frame.scale * Mat3::Identity();
    if (frame.axes == "ras") matrix = (Vec3(-1, -1, 1).asDiagonal() * matrix).eval();
    for (const std::string& text : frame.rotations) matrix = (rotation(text) * matrix).eval();
    return matrix;
}

void transform(const Mat3& matrix, std::vector<Vec3>& points) {
    if (matrix == Mat3::Identity()) return;
    for (Vec3& p : points) p = (matrix * p).eval();
}

}  // namespace anatomy

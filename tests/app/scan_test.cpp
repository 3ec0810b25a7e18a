/// From a CT and a mask of its vessels to an image, by the program alone, against closed forms.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "physics/geometry/vec.h"
#include "render/picture/png.h"
#include "tests/app/program.h"

namespace app {
namespace {

using geometry::Vec3;

constexpr int nx = 100, ny = 76, nz = 164;
constexpr double voxel = 1.5;

Vec3 place(int i, int j, int k) {
    return voxel * Vec3(i - 0.5 * (nx - 1), j - 0.5 * (ny - 1), k - 0.5 * (nz - 1));
}

/// A tube with round ends.
struct Capsule {
    Vec3 from, to;
    double radius;

    double outside(const Vec3& x) const {
        const Vec3 way = to - from;
        const double t = std::clamp((x - from).dot(way) / way.squaredNorm(), 0.0, 1.0);
        return (x - from - t * way).norm() - radius;
    }
    /// Where a ray is in the tube, between its ends and the border of the volume: from, to; the first larger
    /// where it misses it.
    std::pair<double, double> chord(const Vec3& source, const Vec3& ray) const {
        const Vec3 axis = (to - from).normalized(), off = source - from;
        const Vec3 d = ray - ray.dot(axis) * axis, o = off - off.dot(axis) * axis;
        const double a = d.squaredNorm(), b = o.dot(d), c = o.squaredNorm() - radius * radius,
                     root = b * b - a * c;
        if (root <= 0) return {1, 0};
        double first = (-b - std::sqrt(root)) / a, last = (-b + std::sqrt(root)) / a;
        const auto keep = [&](const Vec3& normal, const Vec3& on) {
            const double slope = ray.dot(normal), at = (on - source).dot(normal) / slope;
            slope > 0 ? first = std::max(first, at) : last = std::min(last, at);
        };
        keep(axis, from);
        keep(Vec3::UnitZ(), place(0, 0, 0));
        return {first, last};
    }
};

const Capsule trunk{{-8, -4, -130}, {10, 5, 130}, 7}, side{{1, 0.5, 0}, {42, -6, 85}, 4.5};
template <class Value, class At>
std::string nrrd(const char* type, const At& at) {
    std::string text = fmt::format(
        "NRRD0004\ntype: {}\ndimension: 3\nsizes: {} {} {}\nencoding: raw\nendian: little\n"
        "space: left-posterior-superior\nspace directions: ({},0,0) (0,{},0) (0,0,{})\nspace origin: "
        "({},{},{})\n\n",
        type, nx, ny, nz, voxel, voxel, voxel, place(0, 0, 0).x(), place(0, 0, 0).y(), place(0, 0, 0).z());
    for (int k = 0; k < nz; ++k)
        for (int j = 0; j < ny; ++j)
            for (int i = 0; i < nx; ++i) {
                const Value value = at(place(i, j, k));
                text.append(reinterpret_cast<const char*>(&value), sizeof value);
            }
    return text;
}

using Scan = test::InFolder;

}  // namespace

TEST_F(Scan, ItsMaskBecomesVesselsWhoseImageHasTheClosedForm) {
    test::write(folder / "ct.nrrd", nrrd<std::int16_t>("int16", [](const Vec3& x) {
                    return static_cast<std::int16_t>(std::hypot(x.x() / 62, x.y() / 45) <= 1 ? 0 : -1000);
                }));
    test::write(folder / "mask.nrrd", nrrd<std::uint8_t>("uint8", [](const Vec3& x) {
                    return static_cast<std::uint8_t>(std::min(trunk.outside(x), side.outside(x)) <= 0);
                }));
    const test::Outcome import =
        succeeded(folder, {"anatomy", "import", folder / "mask.nrrd", "--ct", folder / "ct.nrrd", "--out",
                           folder / "v", "--name", "y", "--inlet", "-7.5,-3.7,-122"});
    test::expect_said(import.out, "removed: nothing");
    test::write(folder / "x.gw", "0 beam on\n1 end\n");
    EXPECT_LE(test::run(folder, {"run", folder / "v/y.toml", "--commands", folder / "x.gw", "--out",
                                 folder / "run", "--truth", "--truth-of", "lengths"})
                  .code,
              1);
    const auto truth = nlohmann::json::parse(test::read(folder / "run/truth/frame_000000.json"));
    const auto& layer = truth["layer_lengths"]["layers"].at(0);
    ASSERT_EQ(layer["name"], "lumen");
    const double mm = truth["layer_lengths"]["mm_per_level"];
    const render::DeepImage lengths =
        render::read_deep_png(folder / ("run/truth/" + layer["file"].get<std::string>()));
    Eigen::Matrix<double, 3, 4> camera;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 4; ++c) camera(r, c) = truth["camera_matrix"][r][c];
    const geometry::Mat3 inverse = camera.leftCols<3>().inverse();
    const Vec3 source = -inverse * camera.col(3);
    double squares = 0, sum = 0, expected = 0;
    int count = 0, edge = 0;
    for (int j = 0; j < lengths.height; j += 3)
        for (int i = 0; i < lengths.width; i += 3) {
            const Vec3 ray = (inverse * Vec3(i + 0.5, j + 0.5, 1)).normalized();
            const auto a = trunk.chord(source, ray), b = side.chord(source, ray);
            double chord = std::max(a.second - a.first, 0.0) + std::max(b.second - b.first, 0.0);
            if (a.first < a.second && b.first < b.second)
                chord -= std::max(std::min(a.second, b.second) - std::max(a.first, b.first), 0.0);
            const double found = mm * lengths.pixels[static_cast<std::size_t>(j) * lengths.width + i];
            squares += (found - chord) * (found - chord);
            sum += found - chord, expected += chord;
            ++count;
            edge += (found > 0) != (chord > 0);
        }
    std::printf("%d rays: rms %.3f mm, mean %.4f mm, of %.3f mm; %d silhouettes differ\n", count,
                std::sqrt(squares / count), sum / count, expected / count, edge);
    // A tenth of a voxel of the surface is 0.3 mm of a ray through both sides, and a ninth of the rays meet
    // it.
    EXPECT_LT(std::sqrt(squares / count), 0.15);
    EXPECT_LT(std::abs(sum), 0.01 * expected);
    EXPECT_LT(edge, 0.002 * count);
}

/// Three commands from a mask to a course that the other commands play.
TEST_F(Scan, ItsMaskBecomesAPlan) {
    test::write(folder / "mask.nrrd", nrrd<std::uint8_t>("uint8", [](const Vec3& x) {
                    return static_cast<std::uint8_t>(std::min(trunk.outside(x), side.outside(x)) <= 0);
                }));
    succeeded(folder, {"anatomy", "import", folder / "mask.nrrd", "--out", folder / "v", "--name", "y",
                       "--inlet", "-7.5,-3.7,-122"});
    succeeded(folder, {"anatomy", "check", folder / "v/y.anatomy.json"});
    const test::Outcome planned =
        succeeded(folder, {"plan", folder / "v/y.anatomy.json", "--to", "32,-4.5,65", "--devices", "glide035",
                           "--frames", "6000", "--out", folder / "plan"});
    test::expect_said(planned.out, "yes");
    succeeded(folder, {"run", folder / "plan/best.toml", "--commands", folder / "plan/best.gw", "--out",
                       folder / "run", "--frames", "none"});
}

}  // namespace app

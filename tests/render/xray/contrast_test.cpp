#include "render/xray/contrast.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <stdexcept>
#include <thread>

#include "physics/geometry/random.h"
#include "render/patient/solids.h"
#include "render/xray/path_length.h"
#include "render/xray/surface_crossings.h"

namespace {

using geometry::Polyline;
using geometry::TriangleMesh;
using geometry::Vec3;
using render::CArm;
using render::ContrastMatrix;
using render::Field;
using render::LumenContrast;

/// A straight vessel and its nodes, 1.5 mm apart.
struct Vessel {
    TriangleMesh mesh;
    Polyline nodes;
    std::vector<float> radii;

    Vessel(const Vec3& from, const Vec3& to, double radius, int around = 256) {
        const Vec3 way = to - from;
        const Vec3 across = way.normalized().unitOrthogonal();
        mesh = render::tube({from, to}, across, {radius, radius}, {radius, radius}, around);
        const int count = static_cast<int>(way.norm() / 1.5);
        for (int i = 0; i < count; ++i) {
            nodes.push_back(from + (i + 0.5) / count * way);
            radii.push_back(static_cast<float>(radius));
        }
    }
    Vessel& operator+=(const Vessel& other) {
        render::append(mesh, other.mesh);
        nodes.insert(nodes.end(), other.nodes.begin(), other.nodes.end());
        radii.insert(radii.end(), other.radii.begin(), other.radii.end());
        return *this;
    }
    LumenContrast contrast() const { return {mesh, nodes, radii}; }
};

CArm frontal(int pixels = 256) {
    return CArm{.detector_width = 200.0, .pixels = pixels};
}

CArm oblique(int pixels = 256) {
    CArm arm = frontal(pixels);
    arm.lao = 0.5;
    arm.cranial = -0.2;
    arm.isocentre = Vec3(3, -8, 12);
    return arm;
}

/// The infinite cylinder's chord of the ray through an image place [mm].
double chord(const CArm& arm, double x, double y, const Vec3& at, const Vec3& axis, double radius) {
    const Vec3 ray = render::ray_direction(arm, x, y), to = at - render::source(arm);
    const Vec3 normal = ray.cross(axis);
    const double distance = std::abs(to.dot(normal)) / normal.norm();
    return distance < radius ? 2 * std::sqrt(radius * radius - distance * distance) / normal.norm() : 0;
}

std::vector<float> all(const ContrastMatrix& matrix, float iodine) {
    return std::vector<float>(static_cast<std::size_t>(matrix.node_count), iodine);
}

Field thickness(const ContrastMatrix& matrix, std::span<const float> iodine) {
    Field out;
    render::iodine_thickness(matrix, iodine, out);
    return out;
}

double sum(const Field& field) {
    double total = 0;
    for (const float value : field.values) total += value;
    return total;
}

TEST(Contrast, OfAStraightTubeIsItsChord) {
    const Vec3 axis = Vec3(0.3, 0.2, 1).normalized();
    const Vessel tube(-60 * axis, 60 * axis, 8);
    const CArm arm = oblique();
    const ContrastMatrix matrix = tube.contrast().at(arm);
    EXPECT_EQ(matrix.unbalanced_rays, 0);
    const Field length = thickness(matrix, all(matrix, 1));
    int compared = 0;
    for (int j = 100; j < 156; ++j) {
        for (int i = 0; i < 256; ++i) {
            double exact = 0;
            for (int s = 0; s < 4; ++s)
                exact +=
                    chord(arm, i + 0.25 + 0.5 * (s % 2), j + 0.25 + 0.5 * (s / 2), Vec3::Zero(), axis, 8) / 4;
            const double found = length.values[static_cast<std::size_t>(j) * 256 + i];
            // At the silhouette the polygon's 0.6 µm of sagitta are a chord of 2·√(2·8·0.0006) = 0.2 mm.
            EXPECT_NEAR(found, exact, exact > 6 ? 0.01 : 0.25) << i << " " << j;
            compared += exact > 6;
        }
    }
    EXPECT_GT(compared, 1000);
}

TEST(Contrast, StaysInThePiecesThatHoldIt) {
    Vessel tube(Vec3(0, 0, -60), Vec3(0, 0, 60), 8);
    const CArm arm = frontal();
    const ContrastMatrix matrix = tube.contrast().at(arm);
    auto iodine = all(matrix, 0);
    for (std::size_t n = 0; n < iodine.size(); ++n) iodine[n] = tube.nodes[n].z() > 0 ? 100.0f : 0.0f;
    const Field image = thickness(matrix, iodine);
    // Rays are within 8 mm of depth of the axis: its half-plane is drawn to 8·(50/750) = 0.5 mm.
    const render::Pixel above = render::project(arm, Vec3(0, 0, 2)),
                        below = render::project(arm, Vec3(0, 0, -2));
    for (int j = 80; j < 176; ++j) {
        const float middle = image.values[static_cast<std::size_t>(j) * 256 + 128];
        if (j + 1 < above.y) {
            EXPECT_NEAR(middle, 1600, 8) << j;
        }
        if (j > below.y) {
            EXPECT_EQ(middle, 0) << j;
        }
    }
}

TEST(Contrast, OfCrossingVesselsCountsEachWithItsOwnIodine) {
    Vessel both(Vec3(-60, 15, 0), Vec3(60, 15, 0), 5);
    const std::size_t first = both.nodes.size();
    both += Vessel(Vec3(-20, -15, -60), Vec3(20, -15, 60), 4);
    const CArm arm = frontal();
    const ContrastMatrix matrix = both.contrast().at(arm);
    auto iodine = all(matrix, 50);
    std::fill(iodine.begin() + static_cast<std::ptrdiff_t>(first), iodine.end(), 200.0f);
    const Field image = thickness(matrix, iodine);
    const Vec3 slant = Vec3(40, 0, 120).normalized();
    int overlapping = 0;
    for (int j = 100; j < 156; ++j) {
        for (int i = 40; i < 216; ++i) {
            const double far = chord(arm, i + 0.5, j + 0.5, Vec3(0, 15, 0), Vec3::UnitX(), 5);
            const double near = chord(arm, i + 0.5, j + 0.5, Vec3(0, -15, 0), slant, 4);
            if (far < 6 || near < 5) continue;
            ++overlapping;
            EXPECT_NEAR(image.values[static_cast<std::size_t>(j) * 256 + i], 50 * far + 200 * near, 10);
        }
    }
    EXPECT_GT(overlapping, 40);
}

TEST(Contrast, OfAVesselThatTouchesAnotherDoesNotShowInThat) {
    for (const Vec3& aside : {Vec3(9.05, 0, 0), Vec3(0, 9.05, 0), Vec3(6.4, 6.4, 0)}) {
        Vessel both(Vec3(0, 0, -60), Vec3(0, 0, 60), 6);
        const std::size_t first = both.nodes.size();
        both += Vessel(Vec3(0, 0, -60) + aside, Vec3(0, 0, 60) + aside, 3);
        const ContrastMatrix matrix = both.contrast().at(frontal());
        auto iodine = all(matrix, 0);
        std::fill(iodine.begin() + static_cast<std::ptrdiff_t>(first), iodine.end(), 1.0f);
        const Vessel alone(Vec3(0, 0, -60) + aside, Vec3(0, 0, 60) + aside, 3);
        const ContrastMatrix own = alone.contrast().at(frontal());
        const Field shared = thickness(matrix, iodine), expected = thickness(own, all(own, 1));
        double wrong = 0;
        for (std::size_t i = 0; i < shared.values.size(); ++i)
            wrong += std::abs(shared.values[i] - expected.values[i]);
        EXPECT_LT(wrong, 1e-3 * sum(expected));
    }
}

TEST(Contrast, OfANarrowBranchBeginsAtItsOstium) {
    Vessel tree(Vec3(0, 0, -60), Vec3(0, 0, 60), 10);
    const std::size_t first = tree.nodes.size();
    // The branch's mesh begins on the axis, its nodes outside the wide vessel.
    const Vessel branch(Vec3(0, 0, 0), Vec3(60, 0, 0), 2.5);
    render::append(tree.mesh, branch.mesh);
    for (std::size_t n = 0; n < branch.nodes.size(); ++n) {
        if (branch.nodes[n].x() < 10) continue;
        tree.nodes.push_back(branch.nodes[n]);
        tree.radii.push_back(2.5f);
    }
    const CArm arm = frontal();
    const ContrastMatrix matrix = tree.contrast().at(arm);
    EXPECT_EQ(matrix.unbalanced_rays, 0);
    auto iodine = all(matrix, 0);
    std::fill(iodine.begin() + static_cast<std::ptrdiff_t>(first), iodine.end(), 1.0f);
    const Field image = thickness(matrix, iodine);
    const double ostium = render::project(arm, Vec3(9, 0, 0)).x,
                 outside = render::project(arm, Vec3(12, 0, 0)).x;
    for (int i = 0; i < 256; ++i) {
        const float length = image.values[static_cast<std::size_t>(128) * 256 + i];
        if (i + 1 < ostium) {
            EXPECT_EQ(length, 0) << i;
        }
        if (i > outside && i < 200) {
            EXPECT_NEAR(length, 5, 0.1) << i;
        }
    }
}

/// A vessel that bends every way.
Vessel bent() {
    Vessel made(Vec3(0, 0, -50), Vec3(0, 0, -45), 7, 8);
    Polyline path;
    std::vector<double> radii;
    for (int i = 0; i <= 100; ++i) {
        const double s = i / 100.0;
        path.emplace_back(30 * std::sin(5 * s), 25 * std::cos(4 * s), -50 + 100 * s);
        radii.push_back(8 - 3 * s);
    }
    made.mesh = render::tube(path, Vec3::UnitX(), radii, radii, 60);
    made.nodes = path;
    made.radii.assign(radii.begin(), radii.end());
    return made;
}

TEST(Contrast, RowSumsAreMeansOfFourRays) {
    Vessel vessels = bent();
    vessels += Vessel(Vec3(-60, 60, -20), Vec3(60, 60, 30), 5, 40);
    const CArm arm = oblique();
    const ContrastMatrix matrix = vessels.contrast().at(arm);
    const Field sums = thickness(matrix, all(matrix, 1));
    const auto crossings = render::surface_crossings(vessels.mesh, arm, 2);
    const double step = render::pixel_width(arm) / arm.sid / 2;
    for (int j = 0; j < 256; ++j) {
        for (int i = 0; i < 256; ++i) {
            double mean = 0;
            for (int ray = 0; ray < 4; ++ray) {
                const int u = 2 * i + ray % 2, v = 2 * j + ray / 2;
                const double x = (u - 255.5) * step, y = (v - 255.5) * step;
                for (const auto& crossing : crossings.of(u, v))
                    mean += (crossing.entry ? -0.25 : 0.25) * crossing.depth * std::sqrt(1 + x * x + y * y);
            }
            EXPECT_NEAR(sums.values[static_cast<std::size_t>(j) * 256 + i], mean, 2e-4) << i << " " << j;
        }
    }
}

TEST(Contrast, OfAVesselThinnerThanAPixelHasItsVolume) {
    const double radius = 0.2;
    const Vec3 from(-20, 0, -31), to(23, 0, 37);
    const Vessel vessel(from, to, radius, 16);
    const CArm arm = frontal(256);  // pixels are 0.53 mm wide at the vessel
    const ContrastMatrix matrix = vessel.contrast().at(arm);
    const double width = render::pixel_width(arm) * arm.sod / arm.sid;
    const double polygon = 0.5 * 16 * std::sin(2 * std::numbers::pi / 16) * radius * radius;
    const double volume = polygon * (to - from).norm();
    EXPECT_NEAR(sum(thickness(matrix, all(matrix, 1))) * width * width, volume, 0.03 * volume);
    // The line of pixels has no gap.
    for (int j = 100; j < 156; ++j) {
        const auto row = [&](std::uint32_t pixel) { return static_cast<int>(pixel) / 256 == j; };
        EXPECT_TRUE(std::any_of(matrix.pixels.begin(), matrix.pixels.end(), row)) << j;
    }
}

TEST(Contrast, OfAMeshWithAHoleIsNeverMoreThanOfTheWholeOne) {
    Vessel vessel = bent();
    vessel += Vessel(Vec3(-40, -30, 0), Vec3(40, -30, 10), 5);
    const CArm arm = oblique();
    const ContrastMatrix whole_matrix = vessel.contrast().at(arm);
    const Field whole = thickness(whole_matrix, all(whole_matrix, 1));
    for (std::size_t t = 0; t < vessel.mesh.triangles.size(); t += 50)
        vessel.mesh.triangles[t] = vessel.mesh.triangles.back();
    const ContrastMatrix matrix = vessel.contrast().at(arm);
    EXPECT_GT(matrix.unbalanced_rays, 100);
    const Field holed = thickness(matrix, all(matrix, 1));
    double lost = 0;
    for (std::size_t i = 0; i < whole.values.size(); ++i) {
        EXPECT_LE(holed.values[i], whole.values[i] + 1e-3f);
        lost += whole.values[i] - holed.values[i];
    }
    EXPECT_LT(lost, 0.1 * sum(whole));
}

TEST(Contrast, MovedByWholePixelsIsTheImageMoved) {
    const Vessel vessel = bent();
    const ContrastMatrix matrix = vessel.contrast().at(oblique());
    auto iodine = all(matrix, 0);
    for (std::size_t n = 0; n < iodine.size(); ++n) iodine[n] = 1 + 0.1f * static_cast<float>(n % 7);
    const Field still = thickness(matrix, iodine);
    Field moved;
    render::iodine_thickness(matrix, iodine, std::vector<render::PixelShift>(iodine.size(), {3, -2}), moved);
    for (int j = 2; j < 250; ++j)
        for (int i = 0; i < 250; ++i)
            ASSERT_NEAR(moved.values[(j - 2) * 256 + i + 3], still.values[j * 256 + i], 1e-4);
}

TEST(Contrast, ThatMovesKeepsItsSumUntilItLeavesTheImage) {
    const Vessel vessel = bent();
    CArm arm = oblique();
    arm.detector_width = 280;
    const ContrastMatrix matrix = vessel.contrast().at(arm);
    const auto iodine = all(matrix, 100);
    const double before = sum(thickness(matrix, iodine));
    Field out;
    for (const render::PixelShift& shift : {render::PixelShift{0.3f, 0.7f}, {-4.1f, 2.6f}, {0, -0.5f}}) {
        render::iodine_thickness(matrix, iodine, std::vector<render::PixelShift>(iodine.size(), shift), out);
        EXPECT_NEAR(sum(out), before, 1e-6 * before);
    }
    const render::PixelShift away{120.25f, 0};
    render::iodine_thickness(matrix, iodine, std::vector<render::PixelShift>(iodine.size(), away), out);
    EXPECT_LT(sum(out), 0.9 * before);
    const render::PixelShift gone{0, -1e30f};
    render::iodine_thickness(matrix, iodine, std::vector<render::PixelShift>(iodine.size(), gone), out);
    EXPECT_EQ(sum(out), 0);
}

TEST(Contrast, OfNodesThatMoveFollowsTheVesselThatMoves) {
    Vessel vessel = bent();
    const CArm arm = oblique();
    const LumenContrast at_rest = vessel.contrast();
    const ContrastMatrix matrix = at_rest.at(arm);
    const Vec3 breath(1.3, -2.1, 4.2);
    Polyline nodes = vessel.nodes;
    for (Vec3& node : nodes) node += breath;
    for (Vec3& vertex : vessel.mesh.vertices) vertex += breath;
    vessel.nodes = nodes;
    const ContrastMatrix again = vessel.contrast().at(arm);
    const Field exact = thickness(again, all(again, 1)), still = thickness(matrix, all(matrix, 1));
    Field moved;
    render::iodine_thickness(matrix, all(matrix, 1), render::pixel_shifts(arm, at_rest.nodes(), nodes),
                             moved);
    double off = 0, unmoved = 0;
    for (std::size_t i = 0; i < exact.values.size(); ++i) {
        off += std::abs(moved.values[i] - exact.values[i]);
        unmoved += std::abs(still.values[i] - exact.values[i]);
    }
    // Blur of the four pixels at the silhouette, and parallax within a vessel's depth.
    EXPECT_LT(off, 0.03 * sum(exact));
    EXPECT_GT(unmoved, 10 * off);
}

TEST(Contrast, ThatIsUnevenlyMixedKeepsItsSumAndIsNeverNegative) {
    Vessel vessel({-3, 5, 40}, {4, -6, -45}, 8, 64);
    vessel += Vessel({20, 0, 30}, {30, 10, -30}, 4, 48);
    const LumenContrast contrast = vessel.contrast();
    for (const unsigned seed : {1u, 2u, 3u}) {
        SCOPED_TRACE(seed);
        geometry::Random draw(seed);
        const auto random = [&] { return static_cast<float>(draw()); };
        for (const CArm& arm : {frontal(), oblique()}) {
            const ContrastMatrix matrix = contrast.at(arm);
            ASSERT_EQ(matrix.offsets.size(), matrix.nodes.size());
            const std::size_t count = static_cast<std::size_t>(matrix.node_count);
            for (std::size_t n = 0; n < count; n += 7) {
                // One node at a time: what moves stays its own.
                std::vector<float> iodine(count, 0.0f);
                iodine[n] = 50.0f + 100.0f * random();
                std::vector<Eigen::Vector3f> streams(count, Eigen::Vector3f::Zero());
                Eigen::Vector3f way(random() - 0.5f, random() - 0.5f, random() - 0.5f);
                streams[n] = way.normalized() * (n % 2 == 0 ? 1.0f : random());
                Field even, uneven, moved;
                render::iodine_thickness(matrix, iodine, even);
                render::iodine_thickness(matrix, iodine, uneven, streams);
                double sum = 0, kept = 0;
                for (std::size_t i = 0; i < even.values.size(); ++i) {
                    ASSERT_TRUE(std::isfinite(uneven.values[i]));
                    ASSERT_GE(uneven.values[i], 0.0f);
                    sum += even.values[i];
                    kept += uneven.values[i];
                }
                EXPECT_NEAR(kept, sum, 1e-5 * sum);
                const std::vector<render::PixelShift> shifts(count, {2.25f, -1.5f});
                render::iodine_thickness(matrix, iodine, shifts, moved, streams);
                double there = 0;
                for (const float value : moved.values) there += value;
                EXPECT_NEAR(there, sum, 1e-4 * sum);
            }
            // Without gradients, the same bits.
            const std::vector<float> iodine = all(matrix, 80);
            Field without, zero;
            render::iodine_thickness(matrix, iodine, without);
            render::iodine_thickness(matrix, iodine, zero,
                                     std::vector<Eigen::Vector3f>(count, Eigen::Vector3f::Zero()));
            EXPECT_EQ(without.values, zero.values);
        }
    }
}

TEST(Contrast, ThatLiesAtTheBackShowsFromTheSideAlone) {
    const Vessel vessel({0, 0, 40}, {0, 0, -40}, 10, 128);
    const LumenContrast contrast = vessel.contrast();
    const auto sides = [&](double lao) {
        CArm arm = frontal();
        arm.lao = lao;
        const ContrastMatrix matrix = contrast.at(arm);
        const std::vector<float> iodine = all(matrix, 100);
        Field out;
        render::iodine_thickness(matrix, iodine, out,
                                 std::vector<Eigen::Vector3f>(iodine.size(), Eigen::Vector3f(0, 0.8f, 0)));
        const float* row = out.values.data() + static_cast<std::ptrdiff_t>(arm.pixels / 2) * arm.pixels;
        double left = 0, right = 0;
        for (int i = 0; i < arm.pixels; ++i) (i < arm.pixels / 2 ? left : right) += row[i];
        return std::pair(left, right);
    };
    const auto [left, right] = sides(0);
    EXPECT_NEAR(left, right, 0.02 * left);
    const auto [one, other] = sides(std::numbers::pi / 2);
    // c (1 + 0.8 x / R) over the halves of a disc: mean |x| is 4 R / 3π.
    const double more = 0.8 * 4 / (3 * std::numbers::pi);
    EXPECT_NEAR(std::max(one, other) / std::min(one, other), (1 + more) / (1 - more), 0.08);
}

TEST(Contrast, HasTheSameBitsAgainAndOnSeveralThreads) {
    const LumenContrast contrast = bent().contrast();
    const ContrastMatrix once = contrast.at(oblique());
    ContrastMatrix others[2];
    {
        std::jthread a([&] { others[0] = contrast.at(oblique()); });
        std::jthread b([&] { others[1] = contrast.at(oblique()); });
    }
    for (const ContrastMatrix& other : others) {
        EXPECT_EQ(once.pixels, other.pixels);
        EXPECT_EQ(once.starts, other.starts);
        EXPECT_EQ(once.nodes, other.nodes);
        EXPECT_EQ(once.lengths, other.lengths);
        EXPECT_EQ(once.offsets, other.offsets);
        EXPECT_EQ(once.reaches, other.reaches);
    }
}

TEST(Contrast, RowsAreInOrderAndHold) {
    const ContrastMatrix matrix = bent().contrast().at(oblique());
    ASSERT_EQ(matrix.starts.size(), matrix.pixels.size() + 1);
    EXPECT_EQ(matrix.starts.back(), matrix.nodes.size());
    EXPECT_TRUE(std::adjacent_find(matrix.pixels.begin(), matrix.pixels.end(), std::greater_equal<>()) ==
                matrix.pixels.end());
    for (std::size_t row = 0; row < matrix.pixels.size(); ++row) {
        ASSERT_LT(matrix.starts[row], matrix.starts[row + 1]);
        for (std::uint32_t k = matrix.starts[row] + 1; k < matrix.starts[row + 1]; ++k)
            ASSERT_LT(matrix.nodes[k - 1], matrix.nodes[k]);
    }
    for (const float length : matrix.lengths) ASSERT_GT(length, 0);
}

TEST(Contrast, RefusesNodesThatAreNone) {
    const TriangleMesh mesh = bent().mesh;
    const Vec3 nowhere(0, std::nan(""), 0);
    EXPECT_THROW(LumenContrast(mesh, {}, {}), std::invalid_argument);
    EXPECT_THROW(LumenContrast(mesh, {Vec3::Zero()}, {1, 2}), std::invalid_argument);
    EXPECT_THROW(LumenContrast(mesh, {Vec3::Zero()}, {0}), std::invalid_argument);
    EXPECT_THROW(LumenContrast(mesh, {nowhere}, {1}), std::invalid_argument);
    TriangleMesh broken = mesh;
    broken.triangles[0][0] = -1;
    EXPECT_THROW(LumenContrast(broken, {Vec3::Zero()}, {1}), std::invalid_argument);
}

}  // namespace

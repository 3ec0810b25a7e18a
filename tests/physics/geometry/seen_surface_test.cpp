#include "physics/geometry/seen_surface.h"

#include <gtest/gtest.h>
#include <random>

#include "physics/wall/field_sampler.h"
#include "physics/wall/station_runs.h"
#include "tests/anatomies.h"

using namespace physics;

namespace {

struct Scene {
    CentrelineTree tree{test::iliac_renal().branches, test::iliac_renal().openings()};
    LumenSurface surface = lumen_surface(test::iliac_renal().lumen, tree);
    SeenSurface triangles{surface};
    std::vector<char> seen = {0, 1};
    std::vector<int> station_of_triangle;  // every third triangle is not seen

    Scene() {
        for (int t = 0; t < surface.count(); ++t) station_of_triangle.push_back(t % 3 != 0);
    }
    SeenStations accept() const { return {seen, station_of_triangle}; }
    /// By asking every triangle.
    NearestTriangle nearest(const Vec3& x) const {
        NearestTriangle best;
        for (int t = 0; t < surface.count(); ++t) {
            if (t % 3 == 0) continue;
            const TrianglePoint at =
                closest_point(surface.corner(t, 0), surface.corner(t, 1), surface.corner(t, 2), x);
            if (best.triangle < 0 || at.square_distance < best.at.square_distance) best = {t, at};
        }
        return best;
    }
};
const Scene& scene() {
    static const Scene scene;
    return scene;
}
void expect_same(const NearestTriangle& a, const NearestTriangle& b) {
    EXPECT_EQ(a.triangle, b.triangle);
    EXPECT_EQ(a.at.square_distance, b.at.square_distance);
    EXPECT_EQ(a.at.feature, b.at.feature);
}

}  // namespace

TEST(SeenSurface, FindsTheTriangleThatAskingAllOfThemFinds) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> within(-1, 1);
    SeenSurface::Patch patch, part;
    for (int k = 0; k < 40; ++k) {
        const int t = static_cast<int>(random() % scene().surface.count());
        const Vec3 middle =
            scene().surface.centroid(t) + 3 * Vec3(within(random), within(random), within(random));
        patch.gather(scene().triangles, middle, 0.9, -1, scene().accept());
        part.gather(patch, middle, 0.3);
        for (int m = 0; m < 6; ++m) {
            const double size = m < 3 ? 0.5 : 0.17;
            const Vec3 x = middle + size * Vec3(within(random), within(random), within(random));
            const NearestTriangle wanted = scene().nearest(x);
            expect_same(wanted, scene().triangles.nearest(x, -1, scene().accept()));
            expect_same(wanted, scene().triangles.nearest(x, 1, scene().accept()));
            expect_same(wanted, patch.nearest(x));
            if (m >= 3) expect_same(wanted, part.nearest(x));
        }
    }
}

TEST(SeenSurface, TellsTheFirstOfTheTrianglesThatMeetInTheClosestPoint) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> within(-1, 1);
    SeenSurface::Patch patch;
    for (int k = 0; k < 20; ++k) {
        const Vec3 corner =
            scene().surface.mesh().vertices[random() % scene().surface.mesh().vertices.size()];
        const NearestTriangle wanted = scene().nearest(corner);
        for (int seed = 0; seed < 3; ++seed)
            expect_same(wanted, scene().triangles.nearest(corner, wanted.triangle + seed, scene().accept()));
        patch.gather(scene().triangles, corner + 0.1 * Vec3(within(random), 1, 1), 0.5, -1, scene().accept());
        expect_same(wanted, patch.nearest(corner));
    }
}

TEST(SeenSurface, FindsNothingWhereNothingIsSeen) {
    const std::vector<char> none = {0, 0};
    const SeenStations accept{none, scene().station_of_triangle};
    SeenSurface::Patch patch;
    EXPECT_EQ(scene().triangles.nearest(Vec3::Zero(), 4, accept).triangle, -1);
    patch.gather(scene().triangles, Vec3::Zero(), 1, -1, accept);
    EXPECT_TRUE(patch.empty());
}

TEST(StationRuns, FindTheStationThatAskingAllOfThemFinds) {
    const auto stations = scene().tree.stations();
    std::vector<int> odd;
    for (int s = 1; s < static_cast<int>(stations.size()); s += 2) odd.push_back(s);
    const StationRuns runs(stations, odd);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> within(-1, 1);
    for (int k = 0; k < 300; ++k) {
        const Station& near = stations[random() % stations.size()];
        const Vec3 x = near.centre + 2 * near.radius * Vec3(within(random), within(random), within(random));
        const auto left = [&](int s) { return stations[s].centre.x() < x.x(); };
        int wanted = odd[0], wanted_left = -1;
        for (const int s : odd) {
            if (stations[s].power(x) < stations[wanted].power(x)) wanted = s;
            if (left(s) && (wanted_left < 0 || stations[s].power(x) < stations[wanted_left].power(x)))
                wanted_left = s;
        }
        EXPECT_EQ(runs.deepest(x, -1), wanted);
        EXPECT_EQ(runs.deepest(x, odd[random() % odd.size()]), wanted);
        EXPECT_EQ(runs.deepest(x, -1, left), wanted_left);
    }
}

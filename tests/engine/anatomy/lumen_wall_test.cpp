#include "engine/anatomy/lumen_wall.h"

#include <algorithm>
#include <gtest/gtest.h>

#include "engine/anatomy/scenes.h"
#include "tests/engine/fixtures.h"

using namespace anatomy;

namespace {

namespace fs = std::filesystem;

const Anatomy& tube() {
    static const Anatomy anatomy = tube_anatomy("tube", {{0, 0, 0}, {5, 0, 0}}, 1.5, 32, 0.5);
    return anatomy;
}

std::vector<fs::path> files(const fs::path& folder) {
    std::vector<fs::path> all;
    for (const auto& entry : fs::directory_iterator(folder)) all.push_back(entry.path());
    std::sort(all.begin(), all.end());
    return all;
}

/// A wall and whether it had to be made.
struct MadeWall {
    std::unique_ptr<physics::LumenWall> wall;
    bool made = false;
};
MadeWall wall_of(const Anatomy& anatomy, const fs::path& folder, double stiffness = 20, double wire = 0.3) {
    MadeWall outcome;
    outcome.wall = cached_distance_field(anatomy, stiffness, wire,
                                         {folder, [&](double, const char*) { outcome.made = true; }});
    return outcome;
}

physics::WallContact contact_at(const physics::LumenWall& wall, const geometry::Vec3& x) {
    physics::WallContact c;
    wall.contacts({&x, 1}, {&c, 1});
    return c;
}

}  // namespace

TEST(LumenWall, ComesFromTheCacheTheSecondTime) {
    const test::TemporaryFolder folder;
    const MadeWall first = wall_of(tube(), folder / "cache"), second = wall_of(tube(), folder / "cache");
    EXPECT_TRUE(first.made);
    EXPECT_FALSE(second.made);
    EXPECT_EQ(files(folder / "cache").size(), 1u);
    for (double r = 0.2; r < 2; r += 0.1) {
        const auto a = contact_at(*first.wall, {2.5, r, 0.1}), b = contact_at(*second.wall, {2.5, r, 0.1});
        EXPECT_EQ(a.penetration, b.penetration);
        EXPECT_EQ(a.normal, b.normal);
        EXPECT_EQ(a.curvature, b.curvature);
    }
}

TEST(LumenWall, OfAnotherWireOrStiffnessFractionsTheCachedField) {
    const test::TemporaryFolder folder;
    const MadeWall first = wall_of(tube(), folder.path(), 20, 0.3),
                   other = wall_of(tube(), folder.path(), 30, 0.5);
    EXPECT_FALSE(other.made);
    const geometry::Vec3 x(2.5, 1.4, 0);
    EXPECT_NEAR(contact_at(*other.wall, x).penetration, contact_at(*first.wall, x).penetration + 0.2, 1e-12);
    EXPECT_EQ(contact_at(*other.wall, x).stiffness, 30);
}

TEST(LumenWall, OfAnotherLumenIsMadeAnew) {
    const test::TemporaryFolder folder;
    wall_of(tube(), folder.path());
    Anatomy moved = tube();
    moved.lumen.vertices[7].x() += 1e-9;
    EXPECT_TRUE(wall_of(moved, folder.path()).made);
    EXPECT_EQ(files(folder.path()).size(), 2u);
}

TEST(LumenWall, ReplacesADamagedCacheFile) {
    const test::TemporaryFolder folder;
    wall_of(tube(), folder.path());
    const fs::path path = files(folder.path()).front();
    const std::string whole = test::read(path);
    std::string bad = whole;
    bad[bad.size() / 2] ^= 1;
    for (const std::string& text : {std::string(), whole.substr(0, whole.size() / 3), bad}) {
        test::write(path, text);
        EXPECT_TRUE(wall_of(tube(), folder.path()).made);
        EXPECT_EQ(test::read(path), whole);
    }
}

TEST(LumenWall, IsMadeWhereNothingCanBeKept) {
    const test::TemporaryFolder folder;
    test::write(folder / "file", "in the way");
    const MadeWall outcome = wall_of(tube(), folder / "file/cache");
    EXPECT_TRUE(outcome.made);
    EXPECT_TRUE(contact_at(*outcome.wall, {2.5, 1.4, 0}).touches());
    EXPECT_TRUE(wall_of(tube(), {}).made);
    EXPECT_EQ(files(folder.path()).size(), 1u);
}

#include "engine/exercise/body.h"

#include <random>
#include <thread>

#include "engine/episode/episode.h"
#include "engine/exercise/exercise.h"
#include "tests/engine/exercise/with_body.h"

namespace exercise {
namespace {

namespace fs = std::filesystem;

int bodies() {
    return anatomy::made(anatomy::Made::Body);
}

bool same(const Body& a, const Body& b) {
    if (a.origin != b.origin || a.layers.size() != b.layers.size()) return false;
    for (std::size_t i = 0; i < a.layers.size(); ++i) {
        const render::TissueLayer &p = a.layers[i], &q = b.layers[i];
        if (p.name != q.name || p.material != q.material || p.inside != q.inside || !p.closed || !q.closed ||
            p.mesh.vertices != q.mesh.vertices || p.mesh.triangles != q.mesh.triangles ||
            p.texture_blobs.size() != q.texture_blobs.size())
            return false;
        for (std::size_t k = 0; k < p.texture_blobs.size(); ++k)
            if (p.texture_blobs[k].middle != q.texture_blobs[k].middle ||
                p.texture_blobs[k].axis != q.texture_blobs[k].axis ||
                p.texture_blobs[k].radius != q.texture_blobs[k].radius ||
                p.texture_blobs[k].elongation != q.texture_blobs[k].elongation ||
                p.texture_blobs[k].fraction != q.texture_blobs[k].fraction)
                return false;
    }
    return true;
}

Body ball() {
    Body body;
    body.origin = {1, -2, 3};
    render::TissueLayer& layer = body.layers.emplace_back();
    layer.name = "ball";
    layer.material = render::Material::CorticalBone;
    layer.inside = render::Material::Lung;
    layer.mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    layer.mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    layer.texture_blobs.push_back({Eigen::Vector3f(1, 2, 3), Eigen::Vector3f(0, 1, 0), 2, 3, -0.5f});
    layer.closed = true;
    return body;
}

std::shared_ptr<const Body> read(const std::string& bytes, std::uint64_t key = 7) {
    return body_of(std::as_bytes(std::span(bytes)), key);
}

}  // namespace

TEST(Body, IsMadeOnceAndHasTheSameBitsFromTheCache) {
    const test::TemporaryFolder folder;
    const anatomy::ModelCache cache{folder / "cache", {}};
    const anatomy::Anatomy vessels = scenario::anatomy_of(test::small_scenario_with_patient(), {});
    const int before = bodies();
    auto first = body_around(vessels, cache);
    EXPECT_EQ(bodies(), before + 1);
    // Shared while somebody has it.
    EXPECT_EQ(body_around(vessels, cache), first);
    EXPECT_EQ(body_around(vessels), first);
    const Body made = *first;
    std::weak_ptr<const Body> gone = first;
    first.reset();
    EXPECT_TRUE(gone.expired());
    EXPECT_TRUE(body_is_kept(vessels, cache));
    const auto again = body_around(vessels, cache);
    EXPECT_EQ(bodies(), before + 1);
    EXPECT_TRUE(same(*again, made));
    // Another cache gets it without its being made again.
    const anatomy::ModelCache other{folder / "other", {}};
    EXPECT_EQ(body_around(vessels, other), again);
    EXPECT_TRUE(body_is_kept(vessels, other));
    EXPECT_EQ(bodies(), before + 1);
}

TEST(Body, ThreadsThatWantTheSameMakeItOnce) {
    const anatomy::Anatomy vessels = scenario::anatomy_of(test::small_scenario_with_patient(), {});
    const int before = bodies();
    std::vector<std::shared_ptr<const Body>> found(4);
    std::vector<std::thread> threads;
    for (auto& place : found) threads.emplace_back([&] { place = body_around(vessels); });
    for (std::thread& thread : threads) thread.join();
    for (const auto& body : found) EXPECT_EQ(body, found[0]);
    EXPECT_EQ(bodies(), before + 1);
}

TEST(Body, IsSharedByExercisesAndNeverMadeForMasksOrWithoutBeam) {
    const test::TemporaryFolder folder;
    const anatomy::ModelCache cache{folder / "cache", {}};
    const int before = bodies();
    episode::Episode masked(test::small_scenario_with_patient(), Pictures::None, cache);
    masked.step({});
    const auto vessels = masked.masks(64).vessels;
    Exercise dark(test::small_scenario_with_patient(), Pictures::Dose, cache);
    dark.next_frame({});
    EXPECT_EQ(bodies(), before);
    for (const anatomy::CacheItem& item : anatomy::cache_items(cache.folder))
        EXPECT_FALSE(item.path.filename().string().starts_with("body-"));
    // Without a cache, for that nobody may read it from there.
    Exercise first(test::small_scenario_with_patient(), Pictures::All),
        second(test::small_scenario_with_patient(), Pictures::Dose);
    second.next_frame(std::vector<script::Command>{script::Beam{true}});
    episode::Episode third(test::small_scenario_with_patient(), Pictures::None);
    third.step({});
    EXPECT_EQ(third.image(64, episode::ImageMode::Live).width, 64);
    EXPECT_EQ(bodies(), before + 1);
    // Masks are the same with and without a body.
    EXPECT_EQ(third.masks(64).vessels.pixels, vessels.pixels);
    EXPECT_EQ(third.masks(64).devices[0].pixels, masked.masks(64).devices[0].pixels);
}

TEST(Body, DamagedFilesAreRefused) {
    const std::string whole = bytes_of(ball(), 7);
    const auto kept = read(whole);
    ASSERT_TRUE(kept);
    EXPECT_TRUE(same(*kept, ball()));
    EXPECT_FALSE(read(whole, 8));
    EXPECT_FALSE(read(whole + "x"));
    for (std::size_t size = 0; size < whole.size(); ++size) EXPECT_FALSE(read(whole.substr(0, size))) << size;
    for (std::size_t i = 0; i < whole.size(); ++i)
        for (const int bit : {0, 7}) {
            std::string damaged = whole;
            damaged[i] = static_cast<char>(damaged[i] ^ (1 << bit));
            EXPECT_FALSE(read(damaged)) << "byte " << i << ", bit " << bit;
        }
}

TEST(Body, ADamagedFileIsMadeAgain) {
    const test::TemporaryFolder folder;
    const anatomy::ModelCache cache{folder / "cache", {}};
    const anatomy::Anatomy vessels = scenario::anatomy_of(test::small_scenario_with_patient(), {});
    const Body made = *body_around(vessels, cache);
    const fs::path file = anatomy::cache_items(cache.folder).at(0).path;
    constexpr unsigned seed = 5;
    std::mt19937 random(seed);
    for (int k = 0; k < 3; ++k) {
        std::string bytes = test::read(file);
        const std::size_t at = random() % bytes.size();
        if (k == 2)
            bytes.resize(at);
        else
            bytes[at] = static_cast<char>(bytes[at] ^ 16);
        test::write(file, bytes);
        EXPECT_FALSE(body_is_kept(vessels, cache));
        const int before = bodies();
        const auto again = body_around(vessels, cache);
        EXPECT_EQ(bodies(), before + 1) << "seed " << seed << ", case " << k;
        EXPECT_TRUE(same(*again, made));
        EXPECT_TRUE(body_is_kept(vessels, cache));
        // A file that goes while it is in use harms nobody.
        fs::remove(file);
        EXPECT_TRUE(same(*again, made));
        EXPECT_EQ(body_around(vessels, cache), again);  // and is put back
        EXPECT_TRUE(fs::exists(file));
    }
}

}  // namespace exercise

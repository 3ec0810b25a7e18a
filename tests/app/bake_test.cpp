/// `seldinger bake`, then simulations on the same cache: what was grown ahead is what they take.

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <thread>

#include "engine/anatomy/model_cache.h"
#include "engine/episode/episode.h"
#include "engine/scenario/scenario.h"
#include "tests/app/program.h"

namespace app {
namespace {

using test::run, test::TemporaryFolder;

scenario::Scenario renal(std::uint64_t seed) {
    scenario::Scenario s = test::shipped_scenario("renal", {{"anatomy.seed", std::to_string(seed)}});
    s.c_arm.pixels = 64;
    return s;
}

/// How many vessels, fields and bodies this process has made.
std::array<int, 3> made() {
    using anatomy::Made;
    return {anatomy::made(Made::Vessels), anatomy::made(Made::Field), anatomy::made(Made::Body)};
}

}  // namespace

using Bake = test::InFolder;

TEST_F(Bake, WhatItGrowsIsWhatSimulationsTake) {
    const std::string cache = folder / "cache";
    const test::Outcome baked =
        succeeded(folder, {"bake", "iliac-renal", "--seeds", "1:2", "--cache", cache});
    test::expect_said(baked.out, "1 of 1");
    const auto items = [&cache] {
        std::vector<std::pair<std::string, std::uintmax_t>> found;
        for (const anatomy::CacheItem& item : anatomy::cache_items(cache))
            found.emplace_back(item.path.filename(), item.bytes);
        std::sort(found.begin(), found.end());
        return found;
    };
    const auto kept = items();
    EXPECT_EQ(kept.size(), 3u);  // vessels, field and body
    const std::array<int, 3> before = made();
    {
        episode::Episode episode(renal(1), exercise::Pictures::None, {cache, {}});
        EXPECT_EQ(episode.image(64, episode::ImageMode::Live).width, 64);
        EXPECT_NE(episode.masks(64).vessels.pixels, std::vector<std::uint8_t>(64 * 64, 0));
        EXPECT_EQ(made(), before);
    }
    EXPECT_EQ(items(), kept);
    // Nor does another kind of writer put its own in their places.
    const test::Outcome again =
        succeeded(folder, {"bake", "iliac-renal", "--seeds", "1:2", "--cache", cache});
    EXPECT_EQ(again.error.find("body"), std::string::npos) << again.error;
    EXPECT_EQ(items(), kept);
}

TEST_F(Bake, TwoProcessesAtOnceKeepWhatOneDoes) {
    const auto bake = [&](const std::string& cache) {
        const test::Outcome baked = succeeded(folder, {"bake", "coronary_right", "--seeds", "1:2",
                                                       "--without-bodies", "--cache", folder / cache});
        test::expect_said(baked.out, "1 of 1");
    };
    bake("one");
    std::thread other([&] { bake("both"); });
    bake("both");
    other.join();
    const auto kept = [&](const std::string& cache) {
        std::map<std::string, std::string> files;
        for (const auto& entry : std::filesystem::directory_iterator(folder / cache))
            files[entry.path().filename()] = test::read(entry.path());
        return files;
    };
    EXPECT_EQ(kept("one").size(), 2u);  // vessels and field, no locks
    EXPECT_EQ(kept("both"), kept("one"));
}

TEST_F(Bake, AnExercisesImagesNeedNoMoreThanWasKept) {
    const std::string cache = folder / "cache";
    succeeded(folder, {"bake", "renal", "--seeds", "5:6", "--image", "64", "--cache", cache});
    const std::array<int, 3> before = made();
    episode::Episode whole(renal(5), exercise::Pictures::None, {cache, {}});
    const render::GrayImage expected = [&] {
        const anatomy::ModelCache other{folder / "other", {}};
        std::filesystem::create_directory(other.folder);
        for (const anatomy::CacheItem& item : anatomy::cache_items(cache))
            if (!item.path.filename().string().starts_with("view-"))
                std::filesystem::copy(item.path, other.folder / item.path.filename());
        return episode::Episode(renal(5), exercise::Pictures::None, other)
            .image(64, episode::ImageMode::Live);
    }();
    EXPECT_EQ(made(), before);
    for (const anatomy::CacheItem& item : anatomy::cache_items(cache))
        if (item.path.filename().string().starts_with("body-")) std::filesystem::remove(item.path);
    EXPECT_EQ(whole.image(64, episode::ImageMode::Live), expected);
    EXPECT_EQ(made(), before);
}

TEST_F(Bake, WithoutBodiesLeavesThemOut) {
    succeeded(folder, {"bake", "lca", "--seeds", "3:4", "--without-bodies", "--cache", folder / "cache"});
    EXPECT_EQ(anatomy::cache_items(folder / "cache").size(), 2u);
}

TEST_F(Bake, AnExerciseWhoseTargetIsAPlaceHasOtherPatientsTooAndOtherKeys) {
    const std::string cache = folder / "cache";
    const std::vector<std::string> words = {"bake",    "renal_cobra", "--seeds", "1:2", "--without-bodies",
                                            "--cache", cache};
    test::expect_said(succeeded(folder, words).out, "1 of 1");
    const std::array<int, 3> before = made();
    const auto play = [&](std::vector<scenario::Override> with) {
        with.push_back({"anatomy.seed", "1"});
        with.push_back({"target.name", "\"RRA\""});
        const episode::Episode episode(test::shipped_scenario("renal_cobra", with), exercise::Pictures::None,
                                       {cache, {}});
        return made();
    };
    EXPECT_EQ(play({}), before);
    // Vessels that stay where they are have another field.
    const std::vector<std::string> coarse = {"--set", "tissue.rigid=true", "--set",
                                             "chain.segment_length_mm=4.0"};
    test::expect_said(succeeded(folder, test::joined(words, coarse)).out, "1 of 1");
    EXPECT_EQ(play({{"tissue.rigid", "true"}, {"chain.segment_length_mm", "4.0"}}), before);
    test::expect_said(run(folder, test::joined({"bake", "iliac-renal", "--seeds", "1:2"}, coarse)).error,
                      "--set: expected an exercise");
}

}  // namespace app

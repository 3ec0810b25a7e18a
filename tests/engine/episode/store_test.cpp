#include "engine/episode/store.h"

#include <chrono>
#include <gtest/gtest.h>
#include <random>
#include <thread>
#include <tuple>

#include "engine/io/files.h"
#include "tests/anatomies.h"
#include "tests/cases.h"
#include "tests/engine/exercise/with_body.h"
#include "tests/engine/fixtures.h"

namespace episode {
namespace {

using script::Advance;
using script::Rotate;

struct Store : test::InFolder {
    Source source_of(const std::string& toml) {
        const auto file = folder / "small.toml";
        io::write_whole(file, toml);
        return {file.string(), {}, test::asset("devices").string(), {}};
    }
};

/// What an episode does and shows on a random course.
std::vector<std::uint64_t> played(Episode& episode, unsigned seed, int frames) {
    std::mt19937 random(seed);
    std::vector<std::uint64_t> seen = {episode.hash()};
    for (int frame = 0; frame < frames; ++frame) {
        const double push = static_cast<double>(random() % 300) / 100 - 1, turn = 0.01 * (random() % 60);
        std::vector<script::Command> commands = {Rotate{turn}};
        if (push > 0)
            commands.emplace_back(Advance{push});
        else if (push < 0)
            commands.emplace_back(script::Withdraw{-push});
        episode.step(commands);
        seen.push_back(episode.hash());
        if (frame % 5 == 0)
            for (const std::uint8_t pixel : episode.image(64, ImageMode::Live).pixels)
                seen.back() = 31 * seen.back() + pixel;
    }
    return seen;
}

TEST_F(Store, AnEpisodeOfAKnownSourceIsAsOneMadeAlone) {
    const Source source = source_of(test::small_toml);
    Episode alone(scenario_of(source), exercise::Pictures::None, test::cache());
    const std::vector<std::uint64_t> expected = played(alone, 5, 60);
    for (int k = 0; k < 4; ++k) {
        const auto shared = open(source, test::cache());
        EXPECT_EQ(played(*shared, 5, 60), expected) << k;
        EXPECT_EQ(&shared->simulation().anatomy(), &open(source, test::cache())->simulation().anatomy());
    }
    Source other = source;
    other.overrides = {{"guidewire.device", "\"rosen035\""}};
    EXPECT_NE(open(other, test::cache())->hash(), expected.front());
    EXPECT_EQ(open(source, test::cache())->hash(), expected.front());
}

TEST_F(Store, ABakedPatientIsTheOneThatWasMade) {
    const anatomy::ModelCache cache{folder / "cache", {}};
    for (const auto& [name, seed, still] :
         {std::tuple("renal", 3, true), {"carotid_vertebral", 0, true}, {"coronary", 0, false}}) {
        // Each takes a patient, fields and images of its own.
        if (name != std::string_view("renal") && !test::all_cases()) continue;
        SCOPED_TRACE(std::string(name) + " " + std::to_string(seed));
        const scenario::Scenario scenario =
            test::shipped_scenario(name, {{"anatomy.seed", std::to_string(seed)}});
        Episode fresh(scenario, exercise::Pictures::None, cache);
        EXPECT_EQ(fresh.keep_view(64), still);
        const std::vector<std::uint64_t> expected = played(fresh, 5, 21);
        Episode baked(scenario, exercise::Pictures::None, cache);
        EXPECT_EQ(anatomy::hash_of(baked.simulation().anatomy()),
                  anatomy::hash_of(fresh.simulation().anatomy()));
        EXPECT_EQ(played(baked, 5, 21), expected);
        // Nor is it another one with contrast, of which a view knows nothing.
        const auto with_contrast = [&](Episode& episode) {
            episode.reset();
            const render::GrayImage before = episode.image(64, ImageMode::Live);
            episode.step(
                std::vector<script::Command>{script::Inject{10, 10, scenario.entry.flush_catheter, 300}});
            for (int k = 0; k < 15; ++k) episode.step({});
            const render::GrayImage after = episode.image(64, ImageMode::Live);
            EXPECT_NE(before, after);
            return after;
        };
        if (scenario.entry.flush_catheter.empty()) continue;
        Episode another(scenario, exercise::Pictures::None, cache);
        EXPECT_EQ(with_contrast(another), with_contrast(fresh));
    }
}

TEST_F(Store, ImagesOfAKeptViewNeedNoBody) {
    const anatomy::ModelCache cache{folder / "cache", {}};
    const scenario::Scenario scenario = test::small_scenario_with_patient();
    const auto items_named = [&](const std::string& start) {
        std::vector<std::filesystem::path> found;
        for (const anatomy::CacheItem& item : anatomy::cache_items(cache.folder))
            if (item.path.filename().string().starts_with(start)) found.push_back(item.path);
        return found;
    };
    std::vector<std::uint64_t> expected;
    render::GrayImage dsa;
    {
        Episode first(scenario, exercise::Pictures::None, cache);
        ASSERT_TRUE(first.keep_view(64));
        expected = played(first, 7, 30);
        dsa = first.image(64, ImageMode::Dsa);
    }
    ASSERT_EQ(items_named("view-").size(), 1u);
    ASSERT_EQ(items_named("body-").size(), 1u);
    const auto bodies = [] { return anatomy::made(anatomy::Made::Body); };
    std::filesystem::remove(items_named("body-")[0]);
    const int before = bodies();
    Episode next(scenario, exercise::Pictures::None, cache);
    EXPECT_EQ(played(next, 7, 30), expected);
    EXPECT_EQ(next.image(64, ImageMode::Dsa), dsa);
    EXPECT_EQ(bodies(), before);
    // Another size, or a view that is damaged, is drawn.
    EXPECT_EQ(next.image(48, ImageMode::Live).width, 48);
    EXPECT_EQ(bodies(), before + 1);
    const std::filesystem::path view = items_named("view-")[0];
    const std::string whole = test::read(view);
    for (const std::string& damaged :
         {whole.substr(0, whole.size() - 1), whole.substr(0, 8) + "?" + whole.substr(9)}) {
        test::write(view, damaged);
        Episode again(scenario, exercise::Pictures::None, cache);
        EXPECT_EQ(played(again, 7, 30), expected);
        EXPECT_TRUE(again.keep_view(64));
        EXPECT_EQ(test::read(view), whole);
    }
}

TEST_F(Store, AFileThatHasChangedIsReadAgain) {
    const Source source = source_of(test::small_toml);
    const auto before = open(source, test::cache());
    source_of(test::small_toml_with("inserted_mm = 20.0", "inserted_mm = 25.00"));
    const auto after = open(source, test::cache());
    EXPECT_EQ(before->reading().inserted.of[0], 20);
    EXPECT_EQ(after->reading().inserted.of[0], 25);
    source_of("schema = 1\nnonsense = 2\n");
    EXPECT_THROW(open(source, test::cache()), io::InputError);
}

TEST_F(Store, ThreadsOpenAndPlayTogether) {
    const Source source = source_of(test::small_toml);
    Episode alone(scenario_of(source), exercise::Pictures::None, test::cache());
    std::vector<std::vector<std::uint64_t>> expected;
    for (unsigned seed = 0; seed < 3; ++seed) {
        alone.reset();
        expected.push_back(played(alone, seed, 12));
    }
    std::vector<std::thread> threads;
    std::array<int, 6> same{};
    for (unsigned t = 0; t < same.size(); ++t)
        threads.emplace_back([&, t] {
            for (unsigned round = 0; round < 4; ++round)
                same[t] +=
                    played(*open(source, test::cache()), (t + round) % 3, 12) == expected[(t + round) % 3];
        });
    for (std::thread& thread : threads) thread.join();
    for (const int count : same) EXPECT_EQ(count, 4);
}

}  // namespace
}  // namespace episode

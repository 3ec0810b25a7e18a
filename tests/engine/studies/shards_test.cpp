#include "engine/studies/shards.h"

#include <nlohmann/json.hpp>

#include "tests/engine/fixtures.h"

namespace studies {
namespace {

StudyOptions quick_options() {
    StudyOptions options;
    options.quick = true;
    options.program = "tests 1";
    return options;
}

const Study& study() {
    return find_study("wall-variation");
}

void make_shard(const test::TemporaryFolder& folder, const char* name, const char* shard,
                const StudyOptions& options = quick_options()) {
    run_shard(study(), io::parse_shard(shard), folder / name, options);
}

/// What merging refuses, without leaving anything.
std::string merge_refusal(const test::TemporaryFolder& folder, std::initializer_list<const char*> names,
                          const StudyOptions& options = quick_options()) {
    std::vector<std::filesystem::path> folders;
    for (const char* name : names) folders.push_back(folder / name);
    const std::string message = test::refusal([&] { merge_shards(folders, folder / "out", options); });
    EXPECT_FALSE(std::filesystem::exists(folder / "out")) << message;
    return message;
}

/// Changes the shard as a broken copy or an edit would.
void edit(const test::TemporaryFolder& folder, const char* name,
          const std::function<void(nlohmann::ordered_json&)>& change) {
    const auto file = folder / name / "shard.json";
    auto json = nlohmann::ordered_json::parse(test::read(file));
    change(json);
    test::write(file, json.dump());
}

}  // namespace

using Shards = test::InFolder;

TEST_F(Shards, NumbersOutOfRangeAreRefused) {
    EXPECT_EQ(io::parse_shard("2/3").index, 2);
    EXPECT_EQ(io::parse_shard("2/3").count, 3);
    for (const char* text : {"", "1", "0/3", "4/3", "-1/3", "1/0", "1/2/3", "a/b", "1/1000000000"})
        EXPECT_NE(test::refusal([&] { io::parse_shard(text); }).find("i/n with 1 <= i <= n"),
                  std::string::npos)
            << text;
    test::expect_refusal([&] { make_shard(folder, "a", "1/41"); }, "expected at most 40, one a piece");
    EXPECT_FALSE(std::filesystem::exists(folder / "a"));
}

TEST_F(Shards, StudiesThatCannotBeCutAreRefused) {
    test::expect_refusal(
        [&] {
            run_shard(find_study("cost"), {1, 2}, folder / "a", quick_options());
        },
        "'cost' cannot be cut; those that can: wall-variation");
}

TEST_F(Shards, OfDifferentRunsAreNotMerged) {
    make_shard(folder, "a", "1/2");
    StudyOptions other = quick_options();
    other.seed = 2;
    make_shard(folder, "seed", "2/2", other);
    test::expect_said(merge_refusal(folder, {"a", "seed"}), "seed 2 was found where");
    other = quick_options();
    other.program = "tests 2";
    make_shard(folder, "program", "2/2", other);
    test::expect_said(merge_refusal(folder, {"a", "program"}), "program \"tests 2\" was found where");
    test::expect_said(merge_refusal(folder, {"a"}, other), "this program has \"tests 2\"");
    make_shard(folder, "thirds", "2/3");
    test::expect_said(merge_refusal(folder, {"a", "thirds"}), "shards 3 was found where");
    make_shard(folder, "size", "2/2");
    edit(folder, "size", [](auto& json) { json["quick"] = false; });
    test::expect_said(merge_refusal(folder, {"a", "size"}), "quick false was found where");
}

TEST_F(Shards, OneMissingOrTwiceThereIsRefused) {
    make_shard(folder, "a", "1/3");
    make_shard(folder, "b", "3/3");
    test::expect_said(merge_refusal(folder, {}), "no folder was given");
    test::expect_said(merge_refusal(folder, {"a", "b"}), "a shard is missing: 2/3");
    test::expect_said(merge_refusal(folder, {"a", "b", "a"}), "shard 1/3 was given twice");
    test::expect_said(merge_refusal(folder, {"a", "none", "b"}),
                      "none/shard.json: no such shard can be read");
}

TEST_F(Shards, DamagedOnesAreRefused) {
    make_shard(folder, "a", "1/1");
    const std::string whole = test::read(folder / "a/shard.json");
    test::write(folder / "a/shard.json", whole.substr(0, whole.size() / 2));
    test::expect_said(merge_refusal(folder, {"a"}), "a/shard.json: the shard is damaged");
    const std::pair<std::function<void(nlohmann::ordered_json&)>, const char*> changes[] = {
        {[](auto& json) { json["rows"].erase(7); }, "row 8 is damaged"},
        {[](auto& json) { json["rows"].erase(39); }, "39 rows were found; expected 40"},
        {[](auto& json) { json["rows"][3][5] = nullptr; }, "row 4 is damaged"},
        {[](auto& json) { json["rows"][3].erase(5); }, "row 4 is damaged"},
        {[](auto& json) { json["shard"] = 2; }, "the shard is damaged"},
        {[](auto& json) { json["seed"] = "one"; }, "the shard is damaged"},
        {[](auto& json) { json["shards"] = 0; }, "the shard is damaged"},
        {[](auto& json) { json["study"] = "cost"; }, "'cost' cannot be cut"},
        {[](auto& json) { json["columns"].erase(2); }, "columns was found"}};
    for (const auto& [change, message] : changes) {
        test::write(folder / "a/shard.json", whole);
        edit(folder, "a", change);
        EXPECT_NE(merge_refusal(folder, {"a"}).find(message), std::string::npos)
            << merge_refusal(folder, {"a"});
    }
}

}  // namespace studies

#include "engine/exercise/score_file.h"

#include <nlohmann/json.hpp>
#include <random>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

#include "engine/exercise/exercise.h"
#include "tests/engine/exercise/played.h"
#include "tests/engine/exercise/treated.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

using Json = nlohmann::json;

/// What the schema that ships objects to, a line each.
std::string objections(const Json& score) {
    static const Json text = Json::parse(test::read(test::asset("score.schema.json")));
    valijson::Schema schema;
    valijson::SchemaParser(valijson::SchemaParser::kDraft7)
        .populateSchema(valijson::adapters::NlohmannJsonAdapter(text), schema);
    valijson::Validator validator;
    valijson::ValidationResults results;
    if (validator.validate(schema, valijson::adapters::NlohmannJsonAdapter(score), &results)) return "";
    std::string found;
    for (valijson::ValidationResults::Error error; results.popError(error);) {
        for (const std::string& step : error.context) found += step;
        found += ": " + error.description + "\n";
    }
    return found;
}

Json report_of(const Exercise& exercise, const std::string& learner, const scenario::Benchmark& benchmark) {
    return Json::parse(
        to_json({"test 1", learner, exercise.finish(), exercise.earlier_attempts(), benchmark}));
}

scenario::Benchmark two_attempts() {
    scenario::Benchmark benchmark;
    benchmark.by = "two people";
    benchmark.attempts = 2;
    benchmark.completed_after.values = {3, 4};
    return benchmark;
}

}  // namespace

TEST(ScoreFile, OfWildHandsIsWhatTheSchemaDescribes) {
    for (unsigned seed = 1; seed <= 40; ++seed) {
        std::mt19937 random(seed);
        const auto pick = [&random](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
        const bool images = seed % 8 == 0;
        Exercise exercise(test::small_scenario(), images);
        const int frames = pick(90);
        for (int index = 0; index < frames; ++index) exercise.next_frame(test::random_commands(random));
        scenario::Benchmark benchmark;
        if (pick(2)) {
            benchmark.by = "two <b>people</b>";
            benchmark.attempts = 2;
            for (const scenario::BenchmarkFigure& figure : scenario::benchmark_figures())
                if (pick(2)) (benchmark.*figure.sample).values = {0.0 + pick(3), 1.5 * pick(9)};
        }
        const std::string learners[] = {"", "Ada", "<b>\"\\ \xff"};
        const Json json = report_of(exercise, learners[pick(3)], benchmark);
        EXPECT_EQ(objections(json), "") << "seed " << seed << "\n" << json.dump(1);
    }
}

TEST(ScoreFile, OfATreatmentIsWhatTheSchemaDescribes) {
    const auto make = [](Exercise& exercise, const script::Command& command, int frames) {
        exercise.next_frame(std::vector<script::Command>{command});
        for (int k = 1; k < frames; ++k) exercise.next_frame({});
    };
    for (const bool stented : {false, true})
        for (const char* plan : {"", "stent_from_mm = 46\nstent_to_mm = 60\n"}) {
            Exercise exercise(test::scenario_to_treat(test::balloon_catheter(stented), plan), false);
            EXPECT_EQ(objections(report_of(exercise, "", {})), "");
            make(exercise, script::Inflate{12}, 120);
            make(exercise, script::Deflate{}, 60);
            make(exercise, script::Reset{}, 3);
            const Json json = report_of(exercise, "", {});
            EXPECT_EQ(objections(json), "") << json.dump(1);
            const Json& before = json["earlier_attempts"][0]["treatment"];
            EXPECT_EQ(before["inflations"], 1);
            EXPECT_EQ(before["stents"].size(), stented ? 1u : 0u);
            EXPECT_EQ(before["lesions"][0]["stented"].is_null(), !stented);
            EXPECT_EQ(json["treatment"]["inflations"], 0);
            Json other = json;
            other["treatment"].erase("lesions");
            EXPECT_NE(objections(other), "");
            other = json;
            other["treatment"]["lesions"][0]["before"]["residual_percent"] = 101;
            EXPECT_NE(objections(other), "");
        }
}

TEST(ScoreFile, TheSchemaRefusesWhatIsNoScore) {
    Exercise exercise(test::small_scenario(), false);
    const std::vector<script::Command> push = {script::Advance{2}};
    for (int k = 0; k < 5; ++k) exercise.next_frame(push);
    const Json score = report_of(exercise, "", two_attempts());
    ASSERT_EQ(objections(score), "");
    for (const auto& [key, value] : score.items()) {
        Json other = score;
        other.erase(key);
        if (key != "max_penetration_at") {
            EXPECT_NE(objections(other), "") << "without " << key;
        }
        other[key] = value.is_string() ? Json(7) : Json("seven");
        EXPECT_NE(objections(other), "") << key;
    }
    Json other = score;
    other["schema"] = 2;
    EXPECT_NE(objections(other), "");
    other = score;
    other["wire_travel"] = 3;
    EXPECT_NE(objections(other), "");
    other = score;
    ASSERT_FALSE(score["handling_errors"]["marks"].empty());
    other["handling_errors"]["marks"][0]["error"] = "sneezed";
    EXPECT_NE(objections(other), "");
}

TEST(ScoreFile, KeepsEveryAttempt) {
    Exercise exercise(test::small_scenario(), false);
    const std::vector<script::Command> push = {script::Advance{2}}, reset = {script::Reset{}};
    for (int attempt = 0; attempt < 3; ++attempt) {
        for (int k = 0; k <= attempt; ++k) exercise.next_frame(push);
        if (attempt < 2) exercise.next_frame(reset);
    }
    const Json json = report_of(exercise, "", {});
    ASSERT_EQ(json["earlier_attempts"].size(), 2u);
    EXPECT_NEAR(json["earlier_attempts"][0]["wire_travel_mm"].get<double>(), 2, 1e-9);
    EXPECT_NEAR(json["earlier_attempts"][1]["wire_travel_mm"].get<double>(), 4, 1e-9);
    EXPECT_NEAR(json["wire_travel_mm"].get<double>(), 6, 1e-9);
    EXPECT_EQ(json["resets"], 2);
    EXPECT_TRUE(json["grade"].is_null());
}

}  // namespace exercise

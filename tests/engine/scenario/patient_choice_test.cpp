/// Other patients of an exercise: other vessels, the same task.

#include <gtest/gtest.h>
#include <set>

#include "tests/engine/fixtures.h"

namespace scenario {
namespace {

const std::string two_patients = R"(
[[lesson.patient]]
seed = 17
sex = "f"
age = 81
indication = "She is 81."
[[lesson.patient]]
seed = 23
)";

std::string renal_with(const std::string& more) {
    const std::string text = test::read(test::asset("scenarios/renal.toml"));
    return text.substr(0, text.find("\n[[lesson.patient]]")) + more;
}

struct PatientChoice : testing::Test {
    void put(const std::string& text) { test::write(file, text); }
    Scenario of(const std::string& patient) const {
        return load_scenario(file, test::asset("devices"), {}, patient);
    }
    std::string refused(const std::string& patient) const {
        return test::refusal([&] { of(patient); });
    }
    test::TemporaryFolder folder;
    std::filesystem::path file = folder / "mine.toml";
};

TEST_F(PatientChoice, AnotherPatientHasOtherVesselsAndTheSameTask) {
    put(renal_with(two_patients));
    const Scenario first = of(""), second = of("2"), third = of("3"), drawn = of("seed:17");
    EXPECT_EQ(of("1").content, first.content);
    EXPECT_EQ(first.patient_text(), "");
    EXPECT_EQ(second.patient_text(), "patient 2: woman, 81");
    EXPECT_EQ(third.patient_text(), "patient 3: seed 23");
    EXPECT_EQ(drawn.patient_text(), "patient seed:17: drawn from seed 17");
    EXPECT_EQ(second.lesson.indication, "She is 81.");
    EXPECT_EQ(third.lesson.indication, first.lesson.indication);
    const std::set<std::uint64_t> contents = {first.content, second.content, third.content, drawn.content};
    EXPECT_EQ(contents.size(), 4u);
    for (const Scenario* s : {&second, &third, &drawn}) {
        EXPECT_EQ(s->name, first.name);
        EXPECT_EQ(s->target.name, first.target.name);
        EXPECT_EQ(s->wire().inserted, first.wire().inserted);
        EXPECT_NE(s->vessels->branches[0].knots[1].place, first.vessels->branches[0].knots[1].place);
    }
}

TEST_F(PatientChoice, OneMayHaveADiseaseOfHisOwn) {
    put(renal_with(two_patients +
                   "[[lesson.patient.stenosis]]\nbranch = \"LRA\"\nat_mm = 12.0\nlength_mm = 8.0\n"
                   "percent = 50.0\n"));
    const Scenario third = of("3");
    EXPECT_EQ(third.patient_who, "seed 23, stenosis");
    EXPECT_EQ(of("2").vessels->stenoses.size(), 0u);
    ASSERT_EQ(third.vessels->stenoses.size(), 1u);
    put(renal_with(two_patients + "stenosis = 3\n"));
    EXPECT_NE(refused("").find("[[anatomy.stenosis]]"), std::string::npos) << refused("");
}

TEST_F(PatientChoice, AListMoreChangesNoRecording) {
    put(renal_with(""));
    const std::uint64_t before = of("").content;
    put(renal_with(two_patients));
    EXPECT_EQ(of("").content, before);
}

TEST_F(PatientChoice, WhatIsNoPatientIsRefusedAndSaysWhich) {
    put(renal_with(two_patients));
    for (const char* word : {"0", "4", "x", "seed:", "seed:0"}) {
        const std::string said = refused(word);
        EXPECT_NE(said.find("from 1 to 3, or seed:17"), std::string::npos) << word << ": " << said;
    }
    put(renal_with("\n[[lesson.patient]]\nage = 50\n"));
    EXPECT_NE(refused("").find("seed"), std::string::npos);
    put(std::string(test::small_toml) + two_patients);
    EXPECT_EQ(refused(""), "");
    EXPECT_NE(refused("2").find("has one patient"), std::string::npos);
}

}  // namespace
}  // namespace scenario

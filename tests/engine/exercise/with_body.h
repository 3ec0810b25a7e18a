#pragma once
/// Exercises of the small scenario with a patient around it.

#include <memory>

#include "engine/exercise/body.h"
#include "tests/engine/fixtures.h"

namespace test {

inline scenario::Scenario small_scenario_with_patient(const std::string& more = "") {
    return small_scenario(small_toml_with("patient = false", "patient = true") + more);
}

/// The tests of a suite share its body, which takes seconds to make; nothing that they see depends on it.
struct WithBody : testing::Test {
    static void SetUpTestSuite() {
        shared = exercise::body_around(scenario::anatomy_of(small_scenario_with_patient()));
    }
    static void TearDownTestSuite() { shared.reset(); }
    static inline std::shared_ptr<const exercise::Body> shared;
};

}  // namespace test

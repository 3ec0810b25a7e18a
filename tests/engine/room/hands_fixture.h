#pragma once
/// Hands on a small exercise.

#include <gtest/gtest.h>

#include "engine/exercise/exercise.h"
#include "engine/room/hands.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"

namespace room {

using exercise::StepReport;

class HandsTest : public testing::Test {
protected:
    explicit HandsTest(const std::string& toml = test::small_toml)
        : HandsTest(test::small_scenario(toml), exercise::Pictures::All) {}
    HandsTest(const scenario::Scenario& scenario, exercise::Pictures pictures)
        : exercise(scenario, pictures, test::cache()),
          map(load_keys(test::asset("keys.toml"))),
          hands(map, 1 / exercise.simulation().scenario().frame_rate) {}

    std::vector<script::Command> commands(const Input& input) {
        return hands.commands(input, exercise.simulation(), last, messages);
    }
    void frame(const Input& input) { last = exercise.next_frame(commands(input)).motion; }
    static Input holding(std::initializer_list<Action> held) {
        Input input;
        for (const Action action : held) input.held.set(static_cast<std::size_t>(action));
        return input;
    }
    static Input pressing(std::initializer_list<Action> pressed) {
        Input input;
        input.pressed = pressed;
        return input;
    }

    exercise::Exercise exercise;
    KeyMap map;
    Hands hands;
    StepReport last;
    Messages messages;
};

template <class Kind>
const Kind* find(const std::vector<script::Command>& commands) {
    for (const script::Command& command : commands)
        if (const Kind* found = std::get_if<Kind>(&command)) return found;
    return nullptr;
}

}  // namespace room

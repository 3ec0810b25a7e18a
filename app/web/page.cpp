/// What the page's worker calls: exercises of the engine, with answers as JSON.

#include <emscripten.h>
#include <exception>
#include <nlohmann/json.hpp>
#include <string>

#include "engine/exercise/exercise.h"
#include "engine/exercise/score_file.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "engine/scenario/scenario.h"
#include "engine/script/command.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* devices = "/assets/devices";

anatomy::ModelCache baked() {
    anatomy::ModelCache cache;
    cache.folder = "/cache";
    return cache;
}

/// The answer lives until the next call.
const char* answer(const Json& json) {
    static std::string text;
    text = json.dump();
    return text.c_str();
}

/// Calls `work`, whose errors become {"error": "…"}.
template <class Work>
const char* answered(const Work& work) {
    try {
        return answer(work());
    } catch (const std::exception& error) {
        return answer({{"error", error.what()}});
    }
}

}  // namespace
}  // namespace app

extern "C" {

/// Plays a recording without images: {"frames": n, "states": n, "differences": ["…"], "score": {…}}.
EMSCRIPTEN_KEEPALIVE const char* seldinger_replay(const char* scenario_file, const char* recording) {
    return app::answered([&] {
        const scenario::Scenario scenario = scenario::load_scenario(scenario_file, app::devices, {});
        const script::CommandScript script = script::load_commands(recording);
        exercise::Exercise exercise(scenario, exercise::Pictures::None, app::baked(), &script);
        const int last = script.last_frame(1);
        app::Json differences = app::Json::array();
        int compared = 0;
        for (int frame = 0; frame <= last; ++frame) {
            std::vector<script::Command> commands;
            for (const script::TimedCommand& timed : script.at(frame)) commands.push_back(timed.command);
            exercise.next_frame(commands);
            for (const script::StateCheck& check : script.checks) {
                if (check.frame != frame) continue;
                ++compared;
                const std::uint64_t hash = exercise.simulation().state_hash();
                if (hash != check.hash)
                    differences.push_back({{"frame", frame},
                                           {"found", io::hash_text(hash)},
                                           {"expected", io::hash_text(check.hash)}});
            }
        }
        app::Json made{{"frames", last + 1}, {"states", compared}, {"differences", differences}};
        made["score"] = app::Json::parse(exercise::to_json({"", "", exercise.finish(), {}, {}}));
        return made;
    });
}
}

int main() {
    return 0;
}

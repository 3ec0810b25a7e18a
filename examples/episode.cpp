/// An exercise without a window: a program acts, frame by frame, reads what it observes, goes back to an
/// earlier state, and keeps a recording that `seldinger replay` checks. An expected error is an exception
/// that says what was found and what was expected.

#include "engine/episode/episode.h"

#include <cstdio>
#include <exception>

#include "engine/scenario/scenario.h"

int main() try {
    const std::string assets = SELDINGER_ASSETS;
    const scenario::Scenario scenario =
        scenario::load_scenario(assets + "/scenarios/s_bend.toml", assets + "/devices");
    episode::Episode episode(scenario, exercise::Pictures::None);
    const script::Command push = episode::parse_line("advance 2 mm");
    const script::Command turn = episode::parse_line("rotate 20 deg");

    const episode::Episode::Snapshot start = episode.snapshot();
    for (const bool turns : {false, true}) {
        episode.restore(start);
        while (!episode.exercise().completed() && episode.reading().frame < 80) {
            std::vector<script::Command> commands = {push};
            if (turns && episode.reading().frame < 9) commands.push_back(turn);
            episode.step(commands);
            const auto now = episode.reading();
            if (now.frame % 20 == 0)
                std::printf("frame %2d: %3.0f mm of wire inside, tip %5.1f mm from the target\n",
                            static_cast<int>(now.frame), episode.simulation().wire().inserted_length(),
                            now.tip_to_target);
        }
        std::printf("%s\n", episode.exercise().completed() ? "reached" : "not reached");
    }
    try {
        episode.ask(episode::parse_line("advance 2 km"));
    } catch (const std::exception& error) {
        std::printf("%s\n", error.what());
    }
} catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}

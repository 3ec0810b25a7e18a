#pragma once
/// Scripts that tests play in an exercise.

#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "engine/exercise/exercise.h"
#include "engine/script/command.h"

namespace test {

/// The commands of a script's frame.
inline std::vector<script::Command> commands_of(const script::CommandScript& script, int frame) {
    std::vector<script::Command> commands;
    for (const script::TimedCommand& timed : script.at(frame)) commands.push_back(timed.command);
    return commands;
}

/// Makes the frames of a script to its end; `look` sees each and the commands that made it.
inline void play(
    exercise::Exercise& exercise, const std::string& text,
    const std::function<void(const exercise::Frame&, const std::vector<script::Command>&)>& look = {}) {
    const script::CommandScript script = script::parse_commands(text, "x.gw");
    for (int frame = 0; frame <= script.last_frame(0); ++frame) {
        const std::vector<script::Command> commands = commands_of(script, frame);
        const exercise::Frame made = exercise.next_frame(commands);
        if (look) look(made, commands);
    }
}

/// What a restless hand may do in a frame.
inline std::vector<script::Command> random_commands(std::mt19937& random) {
    const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
    const auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    std::vector<script::Command> commands;
    while (pick(3) != 0 && commands.size() < 4) {
        switch (pick(15)) {
            case 0:
            case 1:
                commands.push_back(script::Advance{12 * unit()});
                break;
            case 2:
                commands.push_back(script::Withdraw{8 * unit()});
                break;
            case 3:
                commands.push_back(script::Rotate{6 * unit() - 3});
                break;
            case 4:
                commands.push_back(script::Beam{pick(3) != 0});
                break;
            case 5:
                commands.push_back(script::SetMode{static_cast<script::ImagingMode>(pick(3))});
                break;
            case 6:
                commands.push_back(script::SetPulseRate{script::pulse_rates[pick(3)]});
                break;
            case 7:
                commands.push_back(script::Inject{0.5 + unit(), 3 + unit(), "tube", 320});
                break;
            case 8:
                commands.push_back(script::NewMask{});
                break;
            case 9:
                commands.push_back(script::StoreReference{});
                break;
            case 10:
                commands.push_back(script::MoveArm{unit() - 0.5, {}, {}, {}, {}, {}});
                break;
            case 11:
                commands.push_back(script::ShiftMask{static_cast<script::ShiftMask::Mode>(pick(3)),
                                                     4 * unit() - 2, 4 * unit() - 2});
                break;
            case 12:
                commands.push_back(script::Breathe{pick(3) != 0});
                break;
            case 13:
                commands.push_back(script::MoveTable{{0, 0, 40.0 * pick(5)}});
                break;
            default:
                if (pick(4) == 0)
                    commands.push_back(script::Reset{});
                else
                    commands.push_back(script::Contrast{20 * unit()});
        }
    }
    return commands;
}

}  // namespace test

/// state_fuzz FRAMES [FIRST_SEED] [FOLDER]: plays random cases until so many frames have been played. A case
/// that breaks is left in the folder as SEED.toml and SEED.gw. Exit code 1 when any did.
///
/// state_fuzz hands COURSES [FIRST_SEED]: hands at the speeds of the room's keys in all scenarios that ship.

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <string>
#include <unistd.h>

#include "tests/fuzz/states.h"

namespace {

double resident_MB() {
    std::ifstream file("/proc/self/statm");
    double all = 0, resident = 0;
    file >> all >> resident;
    return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

int play_courses(int courses, long long first) {
    const int broken = fuzz::play_hands(courses, static_cast<std::uint64_t>(first),
                                        [](const std::string& name, int played, const std::string& what) {
                                            fmt::print("{}: {} courses\n{}", name, played, what);
                                            std::fflush(stdout);
                                        });
    fmt::print("{} courses from seed {}, {} broken\n", courses, first, broken);
    return broken > 0;
}

}  // namespace

int main(int count, char** words) {
    const bool hands = count > 2 && std::string(words[1]) == "hands";
    if (count < 2 || std::atoll(words[hands ? 2 : 1]) < 1) {
        fmt::print(stderr,
                   "state_fuzz FRAMES [FIRST_SEED] [FOLDER]\nstate_fuzz hands COURSES [FIRST_SEED]\n");
        return 2;
    }
    if (hands) return play_courses(std::atoi(words[2]), count > 3 ? std::atoll(words[3]) : 1);
    const long long wanted = std::atoll(words[1]);
    std::uint32_t seed = count > 2 ? static_cast<std::uint32_t>(std::atoll(words[2])) : 1;
    const std::filesystem::path folder = count > 3 ? words[3] : "broken-states";
    long long played = 0, next = 0;
    int cases = 0, refused = 0, broken = 0;
    while (played < wanted) {
        const fuzz::StateCase made = fuzz::random_case(seed, 400);
        fuzz::StateOutcome outcome;
        try {
            outcome = fuzz::play(made);
        } catch (const std::exception& error) {
            outcome.broken = fmt::format("an exception: {}", error.what());
        }
        ++cases;
        refused += !outcome.refused.empty();
        played += outcome.frames;
        if (!outcome.broken.empty()) {
            ++broken;
            std::filesystem::create_directories(folder);
            std::ofstream(folder / fmt::format("{}.toml", seed)) << made.scenario;
            std::ofstream(folder / fmt::format("{}.gw", seed)) << made.script;
            fmt::print("seed {}: {}\n", seed, outcome.broken);
        }
        if (played >= next) {
            fmt::print("{} frames, {} cases, {} refused, {} broken, {:.0f} MB resident\n", played, cases,
                       refused, broken, resident_MB());
            std::fflush(stdout);
            next += wanted / 20;
        }
        ++seed;
    }
    fmt::print("{} frames, {} cases up to seed {}, {} refused, {} broken, {:.0f} MB resident\n", played,
               cases, seed - 1, refused, broken, resident_MB());
    return broken > 0;
}

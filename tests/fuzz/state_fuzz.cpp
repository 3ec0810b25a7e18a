/// state_fuzz FRAMES [FIRST_SEED] [FOLDER]: plays random cases until so many frames have been played. A case
/// that breaks is left in the folder as SEED.toml and SEED.gw. Exit code 1 when any did.

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

}  // namespace

int main(int count, char** words) {
    if (count < 2 || std::atoll(words[1]) < 1) {
        fmt::print(stderr, "state_fuzz FRAMES [FIRST_SEED] [FOLDER]\n");
        return 2;
    }
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

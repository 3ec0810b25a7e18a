/// `seldinger list`.

#include <fmt/format.h>

#include "app/command.h"
#include "engine/scenario/scenario.h"

namespace app {

Command add_list(CLI::App& parser) {
    CLI::App* command = parser.add_subcommand("list", "List the scenarios that ship");
    return {command, [] {
                for (const std::filesystem::path& file : scenario::shipped_scenarios(assets() / "scenarios"))
                    fmt::print("{:<16} {}\n", file.stem().string(), scenario::load_scenario(file).title);
                return done;
            }};
}

}  // namespace app

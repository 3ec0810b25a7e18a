/// `seldinger list`.

#include <fmt/format.h>
#include <memory>

#include "app/command.h"
#include "engine/scenario/device.h"
#include "engine/scenario/scenario.h"

namespace app {

Command add_list(CLI::App& parser) {
    const auto what = std::make_shared<std::string>("scenarios");
    CLI::App* command = parser.add_subcommand("list", "List the scenarios, or the devices, that ship");
    command->add_option("what", *what, "'scenarios' or 'devices'")
        ->check(CLI::IsMember({"scenarios", "devices"}));
    return {command, [what] {
                if (*what == "devices") {
                    for (const std::filesystem::path& file : scenario::device_files(assets() / "devices")) {
                        const scenario::Device device = scenario::load_device(file);
                        fmt::print("{:<16} {:<9} {}\n", device.name,
                                   device.kind == scenario::DeviceKind::Wire ? "wire" : "catheter",
                                   device.title);
                    }
                    return done;
                }
                for (const std::filesystem::path& file : scenario::shipped_scenarios(assets() / "scenarios"))
                    fmt::print("{:<16} {}\n", file.stem().string(),
                               scenario::load_scenario(file, assets() / "devices").title);
                return done;
            }};
}

}  // namespace app

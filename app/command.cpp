#include "app/command.h"

#include <cstdlib>
#include <fmt/format.h>

#include "engine/io/error.h"

namespace app {

const char* const program = "seldinger " SELDINGER_VERSION;

std::filesystem::path program_folder() {
    return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

std::filesystem::path assets() {
    const char* named = std::getenv("SELDINGER_ASSETS");
    const std::filesystem::path folder =
        named ? std::filesystem::path(named) : program_folder().parent_path() / "share" / "seldinger";
    if (!std::filesystem::is_directory(folder / "scenarios"))
        throw io::InputError(fmt::format(
            "{}: no folder of assets was found{}; one with scenarios/ and scripts/ is accepted",
            folder.string(), named ? " (named by SELDINGER_ASSETS)" : ", where the program looks for them"));
    return folder;
}

}  // namespace app

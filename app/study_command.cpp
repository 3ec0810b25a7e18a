/// `seldinger study`: starts seldinger-study from the folder of this program.

#include <string>
#include <unistd.h>
#include <vector>

#include "app/command.h"
#include "engine/io/error.h"

namespace app {
namespace {

int start_studies(std::vector<std::string> arguments) {
    const std::string file = (program_folder() / "seldinger-study").string();
    arguments.insert(arguments.begin(), file);
    std::vector<char*> values;
    for (std::string& argument : arguments) values.push_back(argument.data());
    values.push_back(nullptr);
    execv(file.c_str(), values.data());
    throw io::InputError(
        "{}: not found, so there are no studies here; './app/build.sh release seldinger-study' in the source "
        "builds it",
        file);
}

}  // namespace

Command add_study(CLI::App& parser) {
    CLI::App* command = parser.add_subcommand("study", "Run a study, or without an ID list them");
    command->set_help_flag();  // the other program has its own
    command->allow_extras();
    return {command, [command] { return start_studies(command->remaining()); }};
}

}  // namespace app

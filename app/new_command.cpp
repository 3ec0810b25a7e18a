/// `seldinger new`: a scenario to begin with.

#include <memory>
#include <string>

#include "app/command.h"
#include "engine/author/starter.h"
#include "engine/io/files.h"

namespace app {
namespace {

struct NewArguments {
    std::string name, from, folder;
    std::vector<std::string> exercises;
};

int make(const NewArguments& arguments) {
    if (!scenario::is_exercise_name(arguments.name))
        throw io::InputError(
            "'{}': expected a name of up to 64 letters, digits, '-' and '_' that begins with a letter or "
            "digit",
            arguments.name);
    const scenario::ExerciseFolders folders = exercise_folders(arguments.exercises);
    for (const scenario::ExerciseFiles& one : folders.all())
        if (one.name == arguments.name)
            throw io::InputError("'{}' is there already, {}; expected another name", one.name,
                                 one.file.string());
    const std::filesystem::path folder =
        arguments.folder.empty() ? folders.users() : std::filesystem::path(arguments.folder);
    if (folder.empty())
        throw io::InputError(
            "expected HOME or XDG_DATA_HOME to name a folder, found neither; --folder names one");
    const std::filesystem::path file = folder / (arguments.name + ".toml");
    const std::string text =
        arguments.from.empty()
            ? author::starter(arguments.name)
            : author::starter_from(exercise_named({arguments.from, arguments.exercises}).file, arguments.name,
                                   folder, catalogue());
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (!io::make_new(file))
        throw io::InputError("{}: it is there already; expected another name", file.string());
    io::write_whole(file, text);
    print("{}: 'seldinger check {}' looks it over\n", file.string(),
          arguments.folder.empty() ? arguments.name : file.string());
    return done;
}

}  // namespace

Command add_new(CLI::App& parser) {
    const auto arguments = std::make_shared<NewArguments>();
    CLI::App* command = parser.add_subcommand("new", "A scenario of your own to begin with, with comments");
    command->add_option("name", arguments->name, "Of the exercise: letters, digits, '-' and '_'")->required();
    command->add_option("--from", arguments->from,
                        "An exercise that it begins as: a name, or a file (.toml)");
    command->add_option("--folder", arguments->folder,
                        "Folder for NAME.toml; else ~/.local/share/seldinger/exercises, where every command "
                        "finds it by its name");
    add_exercises(command, arguments->exercises);
    return {command, [arguments] { return make(*arguments); }};
}

}  // namespace app

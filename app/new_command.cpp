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
    const scenario::ExerciseFolders folders = exercise_folders(arguments.exercises);
    for (const scenario::ExerciseFiles& one : folders.all())
        if (one.name == arguments.name)
            throw io::InputError("expected a new name, found '{}', which is there already, in {}", one.name,
                                 one.file.string());
    const std::filesystem::path folder =
        arguments.folder.empty() ? folders.users() : std::filesystem::path(arguments.folder);
    if (folder.empty())
        throw BadArgument("expected HOME, XDG_DATA_HOME or --folder to name a folder, found none");
    const std::filesystem::path file = folder / (arguments.name + ".toml");
    const std::string text =
        arguments.from.empty()
            ? author::starter(arguments.name)
            : author::starter_from(exercise_named({arguments.from, arguments.exercises}).file, arguments.name,
                                   folder, catalogue());
    if (!folder.empty()) io::make_folder(folder);
    if (!io::make_new(file)) throw io::InputError("{}: expected a new name, found this file", file.string());
    io::write_whole(file, text);
    print("{}: 'seldinger check {}' looks it over\n", file.string(),
          arguments.folder.empty() ? arguments.name : file.string());
    return done;
}

}  // namespace

Command add_new(CLI::App& parser) {
    const auto arguments = std::make_shared<NewArguments>();
    CLI::App* command = parser.add_subcommand("new",
                                              "A scenario of your own to begin with, with comments\n\n"
                                              "Examples:\n"
                                              "  seldinger new mine\n"
                                              "  seldinger new mine --from renal --folder course");
    command->add_option("name", arguments->name, "Of the exercise: letters, digits, '-' and '_'")
        ->required()
        ->type_name("NAME")
        ->check(
            text_that(scenario::is_exercise_name,
                      "a name of up to 64 letters, digits, '-' and '_' that begins with a letter or digit"));
    command->add_option("--from", arguments->from, "An exercise that it begins as: a name, or a file (.toml)")
        ->type_name("SCENARIO");
    command
        ->add_option(
            "--folder", arguments->folder,
            "Folder for NAME.toml; else ~/.local/share/seldinger/exercises, where every command finds it "
            "by its name")
        ->type_name("FOLDER");
    add_exercises(command, arguments->exercises);
    command->footer("Exit codes: 0 done, 2 bad input.");
    return {command, [arguments] { return make(*arguments); }};
}

}  // namespace app

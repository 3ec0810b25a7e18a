/// `seldinger study`: starts seldinger-study from the folder of this program.

#include <memory>
#include <string>
#include <unistd.h>
#include <vector>

#include "app/command.h"
#include "app/study_arguments.h"
#include "engine/io/error.h"

namespace app {
namespace {

/// With the words after "study".
int start_studies() {
    const std::string file = (program_folder() / "seldinger-study").string();
    std::vector<std::string> words = given_words();
    words.front() = file;
    std::vector<char*> values;
    for (std::string& word : words) values.push_back(word.data());
    values.push_back(nullptr);
    execv(file.c_str(), values.data());
    throw io::InputError(
        "{}: not found, so there are no studies here; './app/build.sh release seldinger-study' in the source "
        "builds it",
        file);
}

}  // namespace

Command add_study(CLI::App& parser) {
    const auto arguments = std::make_shared<StudyArguments>();
    CLI::App* command = parser.add_subcommand("study", study_description);
    add_study_arguments(*command, *arguments);
    return {command, [arguments] { return start_studies(); }};
}

}  // namespace app

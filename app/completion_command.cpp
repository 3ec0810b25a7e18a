/// `seldinger completion`: scripts that complete command lines in shells, made of the commands themselves.

#include <algorithm>
#include <fmt/format.h>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "app/command.h"
#include "engine/anatomy/grow/vessel_presets.h"

namespace app {
namespace {

/// What completes a word: names that the program is asked for, files or folders, or these words.
struct Values {
    enum class Of { Words, Files, Folders, Exercises, Devices, Studies, None } of = Of::None;
    std::vector<std::string> words = {};
};

struct OptionWords {
    std::vector<std::string> names;
    std::string summary;
    bool flag = false;
    Values values;
};

struct CommandWords {
    std::string path;  // without the program's name
    std::string summary;
    std::vector<std::pair<std::string, std::string>> below;  // names and summaries
    std::vector<OptionWords> options;
    std::vector<Values> arguments;
};

Values values_of(const CLI::Option& option, const CLI::App& root) {
    using Of = Values::Of;
    if (std::vector<std::string> words = words_of(option); !words.empty())
        return {Of::Words, std::move(words)};
    const std::string kind = kind_of(option);
    if (kind == "FILE") return {Of::Files};
    if (kind == "FOLDER") return {Of::Folders};
    if (kind == "SCENARIO") return {Of::Exercises};
    if (kind == "DEVICE") return {Of::Devices};
    if (kind == "STUDY") return {Of::Studies};
    Values values{Of::Words};
    if (kind == "PRESET")
        for (const anatomy::VesselPreset& preset : anatomy::vessel_presets())
            values.words.emplace_back(preset.name);
    if (kind == "COMMAND") {
        for (const CLI::App* one : root.get_subcommands([](const CLI::App*) { return true; }))
            values.words.push_back(one->get_name());
        values.words.emplace_back("script");
    }
    return values.words.empty() ? Values{} : values;
}

void collect(const CLI::App& app, const CLI::App& root, const std::string& path,
             std::vector<CommandWords>& all) {
    CommandWords command{path, summary_of(app), {}, {}, {}};
    for (const CLI::Option* option : app.get_options()) {
        const Values values = values_of(*option, root);
        if (option->get_positional()) {
            command.arguments.push_back(values);
            continue;
        }
        OptionWords words{{}, option->get_description(), kind_of(*option).empty(), values};
        for (const std::string& name : option->get_lnames()) words.names.push_back("--" + name);
        for (const std::string& name : option->get_snames()) words.names.push_back("-" + name);
        command.options.push_back(std::move(words));
    }
    const auto below = app.get_subcommands([](const CLI::App*) { return true; });
    for (const CLI::App* one : below) command.below.emplace_back(one->get_name(), summary_of(*one));
    all.push_back(std::move(command));
    for (const CLI::App* one : below)
        collect(*one, root, path + (path.empty() ? "" : " ") + one->get_name(), all);
}

/// In single quotes, for a shell.
std::string in_quotes(std::string_view text) {
    std::string made = "'";
    for (const char c : text) made += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return made + "'";
}

/// What bash's and zsh's functions below take: "words a b c", "files", …
std::string taken(const Values& values) {
    using Of = Values::Of;
    constexpr std::string_view names[] = {"words",   "files",   "folders", "exercises",
                                          "devices", "studies", "none"};
    std::string text(names[static_cast<std::size_t>(values.of)]);
    if (values.of == Of::Words) text += " " + io::joined(values.words, " ");
    return text;
}

std::vector<std::string> option_names(const CommandWords& command) {
    std::vector<std::string> names;
    for (const OptionWords& option : command.options)
        names.insert(names.end(), option.names.begin(), option.names.end());
    return names;
}

/// The cases of a shell's `case`: of each command its sub-commands, options and arguments, and of each option
/// that takes a value what that is.
std::string cases(const std::vector<CommandWords>& all) {
    std::string text = "    case $command in\n";
    for (const CommandWords& command : all) {
        std::vector<std::string> below;
        for (const auto& [name, summary] : command.below) below.push_back(name);
        text +=
            fmt::format("    {})\n        below={} options={}\n        arguments=(", in_quotes(command.path),
                        in_quotes(io::joined(below, " ")), in_quotes(io::joined(option_names(command), " ")));
        for (const Values& values : command.arguments) text += in_quotes(taken(values)) + " ";
        if (!command.arguments.empty()) text.pop_back();
        text += ")\n        case $before in\n";
        for (const OptionWords& option : command.options)
            if (!option.flag)
                text += fmt::format("        {}) value={} ;;\n", io::joined(option.names, "|"),
                                    in_quotes(taken(option.values)));
        text += "        esac ;;\n";
    }
    return text + "    esac\n";
}

/// Which words complete a kind of value. The first word names the kind; names are asked of the program that
/// is being completed.
constexpr std::string_view shared_functions = R"sh(
_seldinger_names() {
    case $1 in
    exercises) "$seldinger" list 2>/dev/null | sed -n '2,$s/ .*//p' ;;
    devices) "$seldinger" list devices 2>/dev/null | sed 's/ .*//' ;;
    studies) "$seldinger" study 2>/dev/null | sed 's/ .*//' ;;
    esac
}
)sh";

std::string for_bash(const std::vector<CommandWords>& all) {
    std::string text =
        "# Completes command lines of seldinger in bash; made by 'seldinger completion bash'.\n";
    text += shared_functions;
    text += R"sh(
_seldinger() {
    local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]}
    local seldinger=${COMP_WORDS[0]/#\~\//$HOME/}
    local command='' below='' options='' value='' word k=1 place=0
    local -a arguments=()
    COMPREPLY=()
    while ((k <= COMP_CWORD)); do
        before=${COMP_WORDS[k-1]} value=''
)sh";
    text += cases(all);
    text += R"sh(        ((k == COMP_CWORD)) && break
        word=${COMP_WORDS[k]}
        if [[ -n $value || $word == -* ]]; then
            :
        elif [[ -n $below && " $below " == *" $word "* ]]; then
            command=${command:+$command }$word
        else
            ((++place))
        fi
        ((++k))
    done
    if [[ -z $value && $current == -* ]]; then
        COMPREPLY=($(compgen -W "$options" -- "$current"))
        return
    fi
    if [[ -z $value && -n $below ]]; then
        COMPREPLY=($(compgen -W "$below" -- "$current"))
        return
    fi
    if [[ -z $value ]]; then
        ((${#arguments[@]} == 0)) && return
        ((place >= ${#arguments[@]})) && place=$((${#arguments[@]} - 1))
        value=${arguments[place]}
    fi
    local kind=${value%% *} words=${value#* }
    local IFS=$'\n'
    case $kind in
    words) COMPREPLY=($(compgen -W "${words// /$'\n'}" -- "$current")) ;;
    files) COMPREPLY=($(compgen -f -- "$current")) ;;
    folders) COMPREPLY=($(compgen -d -- "$current")) ;;
    none) return ;;
    *)
        COMPREPLY=($(compgen -W "$(_seldinger_names "$kind")" -- "$current"))
        [[ $kind == studies ]] || COMPREPLY+=($(compgen -f -- "$current")) ;;
    esac
    case $kind in files|folders|exercises|devices) compopt -o filenames 2>/dev/null ;; esac
}
complete -F _seldinger seldinger
)sh";
    return text;
}

std::string for_zsh(const std::vector<CommandWords>& all) {
    std::string text =
        "#compdef seldinger\n# Completes command lines of seldinger in zsh; made by 'seldinger completion "
        "zsh'.\n";
    text += shared_functions;
    text += R"sh(
_seldinger() {
    local current=${words[CURRENT]} before='' seldinger=${words[1]/#\~\//$HOME/}
    local command='' below='' options='' value='' word
    local -a arguments names
    integer k=2 place=0
    while ((k <= CURRENT)); do
        before=${words[k-1]} value='' arguments=()
)sh";
    text += cases(all);
    text += R"sh(        ((k == CURRENT)) && break
        word=${words[k]}
        if [[ -n $value || $word == -* ]]; then
            :
        elif [[ -n $below && " $below " == *" $word "* ]]; then
            command=${command:+$command }$word
        else
            ((++place))
        fi
        ((++k))
    done
    if [[ -z $value && $current == -* ]]; then
        compadd -- ${=options}
        return
    fi
    if [[ -z $value && -n $below ]]; then
        compadd -- ${=below}
        return
    fi
    if [[ -z $value ]]; then
        ((${#arguments} == 0)) && return
        ((place >= ${#arguments})) && place=$((${#arguments} - 1))
        value=${arguments[place+1]}
    fi
    local kind=${value%% *} accepted=${value#* }
    case $kind in
    words) compadd -- ${=accepted} ;;
    files) _files ;;
    folders) _files -/ ;;
    none) ;;
    *)
        names=(${(f)"$(_seldinger_names $kind)"})
        compadd -- $names
        [[ $kind == studies ]] || _files ;;
    esac
}
if [[ ${funcstack[1]} == _seldinger ]]; then _seldinger "$@"; else compdef _seldinger seldinger; fi
)sh";
    return text;
}

/// The first sentence or clause, for a list.
std::string short_of(const std::string& summary) {
    return summary.substr(0, std::min(summary.find(';'), summary.find(". ")));
}

std::string for_fish(const std::vector<CommandWords>& all) {
    std::string text =
        "# Completes command lines of seldinger in fish; made by 'seldinger completion fish'.\n"
        "# Whether a word of these comes next ('next PATH'), or the line is of this command ('in PATH').\n"
        "function __seldinger_at\n"
        "    set -l words (commandline -opc)\n"
        "    set -e words[1]\n"
        "    set -l given\n"
        "    for word in $words\n"
        "        string match -q -- '-*' $word; and break\n"
        "        set -a given $word\n"
        "    end\n"
        "    test \"$given\" = \"$argv[2..]\"; and return\n"
        "    test $argv[1] = in; and string match -q -- \"$argv[2..] *\" \"$given\"\n"
        "end\n"
        "function __seldinger_names\n"
        "    set -l seldinger (string replace -r '^~/' ~/ -- (commandline -opc)[1])\n"
        "    switch $argv[1]\n"
        "        case exercises\n"
        "            $seldinger list 2>/dev/null | sed -n '2,$s/ .*//p'\n"
        "        case devices\n"
        "            $seldinger list devices 2>/dev/null | sed 's/ .*//'\n"
        "        case studies\n"
        "            $seldinger study 2>/dev/null | sed 's/ .*//'\n"
        "    end\n"
        "end\n"
        "complete -c seldinger -f\n";
    // -F offers files, -f none.
    const auto completed_by = [](const Values& values) -> std::string {
        using Of = Values::Of;
        switch (values.of) {
            case Of::Words:
                return " -f -a " + in_quotes(io::joined(values.words, " "));
            case Of::Files:
                return " -F";
            case Of::Folders:
                return " -f -a '(__fish_complete_directories)'";
            case Of::Exercises:
                return " -F -a '(__seldinger_names exercises)'";
            case Of::Devices:
                return " -F -a '(__seldinger_names devices)'";
            case Of::Studies:
                return " -f -a '(__seldinger_names studies)'";
            case Of::None:
                return " -f";
        }
        return "";
    };
    for (const CommandWords& command : all) {
        std::string at = command.below.empty() ? "__seldinger_at in" : "__seldinger_at next";
        if (!command.path.empty()) at += " " + command.path;
        at = "complete -c seldinger -n " + in_quotes(at);
        for (const auto& [name, summary] : command.below)
            text += fmt::format("{} -a {} -d {}\n", at, name, in_quotes(summary));
        for (const Values& values : command.arguments) text += at + completed_by(values) + "\n";
        for (const OptionWords& option : command.options) {
            std::string names;
            for (const std::string& name : option.names)
                names += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
            text += fmt::format("{}{} -d {}{}{}\n", at, names, in_quotes(short_of(option.summary)),
                                option.flag ? "" : " -r", option.flag ? "" : completed_by(option.values));
        }
    }
    return text;
}

}  // namespace

Command add_completion(CLI::App& parser) {
    const auto shell = std::make_shared<std::string>();
    CLI::App* command =
        parser.add_subcommand("completion",
                              "A script that completes command lines in your shell\n\n"
                              "Examples:\n"
                              "  source <(seldinger completion bash)\n"
                              "  seldinger completion fish > ~/.config/fish/completions/seldinger.fish");
    command->add_option("shell", *shell, "bash, zsh or fish")
        ->required()
        ->check(one_of({"bash", "zsh", "fish"}));
    return {command, [&parser, shell] {
                std::vector<CommandWords> all;
                collect(parser, parser, "", all);
                write_out(*shell == "bash" ? for_bash(all) : *shell == "zsh" ? for_zsh(all) : for_fish(all));
                return done;
            }};
}

}  // namespace app

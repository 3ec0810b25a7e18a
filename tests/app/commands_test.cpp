/// The command line as a whole: what is refused and in which words, help, versions, completion, JSON.

#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "tests/app/program.h"
#include "tests/cases.h"

namespace app {
namespace {

using test::Outcome, test::read, test::run, test::Started, test::succeeded, test::TemporaryFolder,
    test::write;
using Words = std::vector<std::string>;

struct Commands : test::InFolder {};

struct KnownOption {
    std::string name, kind;  // no kind: a flag
    bool repeated = false;
};

struct KnownCommand {
    Words path;
    std::vector<KnownOption> options;
    Words below;
    bool needs_something = false;  // an argument, an option or a command
};

/// What the help says of the command and those below it; the help is made of what the parser knows.
void walk(const TemporaryFolder& folder, const Words& path, std::vector<KnownCommand>& all) {
    KnownCommand command{path, {}, {}, false};
    std::istringstream help(succeeded(folder, test::joined(path, {"--help"})).out);
    std::string part;
    bool has_commands = false;
    for (std::string line; std::getline(help, line);) {
        std::smatch match;
        if (std::regex_match(line, match, std::regex("([A-Z][a-z ]+):"))) part = match[1];
        if (line.starts_with("Usage: ")) {
            part.clear();
            has_commands = line.find(" COMMAND ") != std::string::npos;
            const std::string after = line.substr(line.find("seldinger") + 9);
            std::string rest = after.substr(0, after.rfind(" [OPTION]"));
            for (const std::string& word : path) rest.erase(0, word.size() + 1);
            command.needs_something = std::regex_search(rest, std::regex("(^| )[^ \\[]"));
        }
        if (part == "Options" &&
            std::regex_match(line, match,
                             std::regex("  (-[^ ]+)(?: ([^ ]+?(?: or FILE)?)(\\.\\.\\.)?)?(?:  .*)?")))
            command.options.push_back({match[1], match[2], match[3].length() > 0});
        if (has_commands && part != "Options" && !part.empty() &&
            std::regex_match(line, match, std::regex("  ([a-z]+)(?:  .*)?")))
            command.below.push_back(match[1]);
    }
    all.push_back(command);
    for (const std::string& below : command.below) walk(folder, test::joined(path, {below}), all);
}

const std::vector<KnownCommand>& all_commands() {
    static const std::vector<KnownCommand> all = [] {
        const TemporaryFolder folder;
        std::vector<KnownCommand> found;
        walk(folder, {}, found);
        return found;
    }();
    return all;
}

std::string name_of(const KnownCommand& command) {
    std::string name = "seldinger";
    for (const std::string& word : command.path) name += " " + word;
    return name;
}

/// Refused by the program's own words, which say the command, what was expected or is unknown, and where help
/// is.
void expect_own_words(const TemporaryFolder& folder, const KnownCommand& command, const Words& more,
                      const std::string& expected) {
    const Outcome result = run(folder, test::joined(command.path, more));
    SCOPED_TRACE(testing::PrintToString(test::joined(command.path, more)));
    EXPECT_EQ(result.code, 2);
    EXPECT_EQ(result.out, "");
    const std::string name = name_of(command);
    EXPECT_TRUE(result.error.starts_with(name + ": ")) << result.error;
    test::expect_said(result.error, "('" + name + " --help')");
    test::expect_said(result.error, expected);
    for (const char* of_library :
         {"is required", "not in range", "ould not convert", "required TEXT", " missing\n", "Run with",
          "not expected", "TEXT", "INT", "FLOAT", "excludes", "requires", "At Most", "At least", "override",
          "other arguments"})
        EXPECT_EQ(result.error.find(of_library), std::string::npos) << of_library << ": " << result.error;
}

}  // namespace

/// Of a quarter of the options, or all: test::cases.
TEST_F(Commands, RefuseBadValuesOfOptionsInTheirOwnWords) {
    ASSERT_GT(all_commands().size(), 25u);
    int options = 0;
    for (const KnownCommand& command : all_commands()) {
        expect_own_words(folder, command, {"--bogus"}, "unknown option '--bogus'");
        expect_own_words(folder, command, {"--bogus=3"}, "unknown option '--bogus'");
        if (command.needs_something && command.path != Words{"benchmark"})
            expect_own_words(folder, command, {}, command.below.empty() ? "missing" : "expected a command");
        if (!command.below.empty()) expect_own_words(folder, command, {"bogus"}, "'bogus' is not a command");
        for (const KnownOption& option : command.options) {
            const std::string name = option.name.substr(option.name.rfind("--"));
            if (++options % 4 != 0 && !test::all_cases()) continue;
            if (option.kind.empty()) {
                expect_own_words(folder, command, {name + "=3"}, "expected no value, found one");
                continue;
            }
            const std::string first = option.name.substr(0, option.name.find(','));
            expect_own_words(folder, command, {name},
                             first + ": expected " + option.kind + ", found nothing");
            expect_own_words(folder, command, {name, name, "x"}, "found the option '" + name + "'");
            if (option.kind == "NUMBER")
                for (const char* bad : {"x", "nan", "1e999", "0x10"})
                    expect_own_words(folder, command, {name, bad}, name + ": expected a ");
            if (option.kind.find('|') != std::string::npos)
                expect_own_words(folder, command, {name, "bogus"}, "found 'bogus'");
            if (option.kind == "X,Y,Z" && command.path != Words{"relax"}) {
                expect_own_words(folder, command, {name, "1,x,3"}, name + ": expected a number, found 'x'");
                expect_own_words(folder, command, {name, "1,2"},
                                 name + ": expected X,Y,Z, found 2 of 3 values");
            }
            if (!option.repeated && option.kind != "NUMBER" && option.kind.find('|') == std::string::npos &&
                option.kind != "X,Y,Z" && option.kind != "i/n" && option.kind != "WIDTHxHEIGHT" &&
                option.kind != "FIRST:END")
                expect_own_words(folder, command, {name, "a.png", name, "b.png"},
                                 name + ": expected it once, found it 2 times");
        }
    }
    EXPECT_GT(options, 150);
}

TEST_F(Commands, SayWhatIsWrongAndWhatWouldDo) {
    write(folder / "push.gw", "0 push 2 mm\n");
    write(folder / "loud.gw", "0 ADVANCE 2 mm\n");
    write(folder / "bare.gw", "0 advance 2\n");
    write(folder / "tight.gw", "0 advance 2mm\n");
    write(folder / "of_lsa.gw",
          "recording 3\nprogram 0123456789abcdef seldinger 0.1.0\nscenario 0123456789abcdef lsa\n"
          "anatomy 0123456789abcdef\n0 end\n");
    std::string steep = read(test::asset("scenarios/stenosis.toml"));
    steep.replace(steep.find("length_mm = 16.0"), 16, "length_mm = 3.0");
    write(folder / "steep.toml", steep);
    const Words straight = {"run", "straight", "--out", folder / "out", "--frames", "none", "--commands"},
                solved = test::joined(straight, {"solution", "--set"});
    const struct {
        Words words;
        const char* expected;
    } cases[] = {
        {{"rnu"}, "seldinger: 'rnu' is not a command (did you mean 'run'?); commands are: play, list, "},
        {{"--versoin"}, "seldinger: unknown option '--versoin' (did you mean '--version'?)"},
        {{"device", "list"}, "seldinger device: 'list' is not a command; commands are: show"},
        {{"cache", "lst"}, "seldinger cache: 'lst' is not a command (did you mean 'list'?)"},
        {{"help", "rnu"}, "'rnu' is not a command (did you mean 'run'?)"},
        {{"run", "renal", "--bogus"}, "seldinger run: unknown option '--bogus' ('seldinger run --help')"},
        {{"run", "renal", "--comands", "x"}, "unknown option '--comands' (did you mean '--commands'?)"},
        {{"run", "renal", "--commands", "x", "--panel"},
         "seldinger run: --out FOLDER is missing ('seldinger run"},
        {{"run"}, "scenario, --commands FILE and --out FOLDER are missing"},
        {{"run", "renal", "--out", "--commands", "x"},
         "--out: expected FOLDER, found the option '--commands'"},
        {{"run", "renal", "more", "--commands", "x", "--out", "y"},
         "expected no more arguments, found 'more'"},
        {{"run", "renal", "--commands"},
         "--commands: expected FILE, found nothing ('seldinger run --help')\n  --commands FILE: Script or "
         "recording"},
        {{"run", "renal", "--every", "x"}, "--every: expected a whole number from 1 to 1000000, found 'x'"},
        {{"run", "renal", "--every", "010"}, "without leading zeros, found '010'"},
        {{"run", "renal", "--frames", "nome"}, "expected all or none, found 'nome' (did you mean 'none'?)"},
        {{"anatomy", "generate", "aorta", "--age", "5"}, "--age: expected a number from 20 to 95, found '5'"},
        {{"score", folder / "of_lsa.gw"}, "'lsa', which was not found in"},
        {{"check", folder / "steep.toml"},
         "steep.toml:14:1: the stenosis of 'aorta+LCIA+LEIA+LCFA' is too steep"},
        {test::joined(solved, {"entry.inserted_mm=5000"}),
         "seldinger: entry.inserted_mm = 5000: expected a number from 1 to 2000"},
        {test::joined(solved, {"schema=2"}), "schema 2 is of a later version; this program reads 1"},
        {test::joined(solved, {"catheter.device=\"cobra\""}),
         "expected a catheter of the catalogue or a file (.toml), found 'cobra' (did you mean 'cobra4f' or "
         "'cobra5f'?); catheters are: "},
        {test::joined(solved, {"guidewire.device=floppy014"}), "in a shell 'guidewire.device=\"floppy014\"'"},
        {test::joined(solved, {"guidewire.friction"}),
         "--set: expected KEY=VALUE, found 'guidewire.friction'"},
        {{"device", "show", "glide"}, "found 'glide' (did you mean 'glide035' or 'glidestraight035'?)"},
        {test::joined(straight, {folder / "push.gw"}),
         "push.gw:1:3: unknown command 'push' (did you mean 'advance'?)"},
        {test::joined(straight, {folder / "loud.gw"}), "unknown command 'ADVANCE' (did you mean 'advance'?)"},
        {test::joined(straight, {folder / "bare.gw"}), "bare.gw:1:12: the unit is missing: '2 mm'"},
        {test::joined(straight, {folder / "tight.gw"}),
         "tight.gw:1:11: '2mm' was found; expected a space in it: '2 mm'"},
        {{"render", "renal", "--out", "x.bmp"},
         "--out: expected a file name that ends in .png, found 'x.bmp'"},
        {{"show", "renal", "--out", "x.jpg"}, "--out: expected a file name that ends in .png, found 'x.jpg'"},
        {{"list", "ranal"}, "no such scenario (did you mean 'renal'?)"},
        {{"anatomy", "generate", "iliac", "--out", "x"}, "(did you mean 'iliac-renal'?); presets are: "},
        {{"bake", "aort", "--seeds", "0:1"}, "(did you mean 'aorta'?)"},
        {{"bake", "aorta", "--seeds", "3"}, "--seeds: expected FIRST:END, as 0:100 for 0 to 99"},
        {{"study", "accurcy", "--out", "x"}, "'accurcy' is not a study (did you mean 'accuracy'?)"},
        {{"study", "accuracy"}, "seldinger study: --out FOLDER is missing ('seldinger study --help')"},
        {{"study", "--shard", "3/2"}, "seldinger study: --shard: expected i/n with i from 1 to n"},
        {{"play", "--size", "9"}, "--size: expected WIDTHxHEIGHT from 320x240 to 8192x8192, found '9'"},
        {{"new", "a/b"}, "seldinger new: name: expected a name of up to 64 letters"},
        {{"benchmark", "--of", "renal"}, "--of: expected --played NUMBER with it, found none"},
        {{"benchmark"}, "expected either a folder of recordings or --played NUMBER, found neither"},
        {{"views", "straight", "--branch", "tub", "--from-mm", "0", "--to-mm", "9"},
         "expected a branch of straight, found 'tub' (did you mean 'tube'?)"},
        {{"views", "straight", "--branch", "tube", "--from-mm", "9", "--to-mm", "9"},
         "expected a stretch of tube at least 1 mm long, found one from 9 to 9 mm"},
        {{"views", "straight", "--branch", "tube", "--from-mm", "9", "--to-mm", "900"},
         "mm from the origin of tube, found 900 mm"},
        {{"views", "straight", "--branch", "tube", "--from-mm", "9"},
         "seldinger views: --branch: expected --from-mm and --to-mm with it, found --from-mm alone"},
        {{"views", "straight", "--to-mm", "9"}, "--to-mm: expected --branch with it, found none"},
        {{"views", "straight", "--contrast", "x"}, "--contrast: expected a branch of straight, found 'x'"},
        {{"completion", "tcsh"}, "expected bash, zsh or fish, found 'tcsh'"}};
    for (const auto& [words, expected] : cases) {
        SCOPED_TRACE(testing::PrintToString(words));
        const Outcome result = run(folder, words);
        EXPECT_EQ(result.code, 2);
        test::expect_said(result.out + result.error, expected);
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

TEST_F(Commands, SayTheirVersionAndTheirHelpHoweverTheyAreAsked) {
    const std::string version = succeeded(folder, {"--version"}).out;
    EXPECT_TRUE(std::regex_match(version, std::regex("seldinger [0-9]+\\.[0-9]+\\.[0-9]+\n"))) << version;
    EXPECT_EQ(succeeded(folder, {"version"}).out, version);
    const std::string top = succeeded(folder, {"help"}).out;
    EXPECT_EQ(succeeded(folder, {"-h"}).out, top);
    EXPECT_LE(std::count(top.begin(), top.end(), '\n'), 60);
    for (const char* part : {"\nExamples:\n", "\nTrain:\n", "\nTeach:\n", "\nMake exercises:\n",
                             "\nRun without a window:\n", "\nStudy the method:\n"})
        test::expect_said(top, part);
    for (const KnownCommand& command : all_commands()) {
        SCOPED_TRACE(name_of(command));
        for (const char* ask : {"--version", "-V"})
            EXPECT_EQ(succeeded(folder, test::joined(command.path, {ask})).out, version);
        const std::string help = succeeded(folder, test::joined(command.path, {"--help"})).out;
        EXPECT_EQ(succeeded(folder, test::joined({"help"}, command.path)).out, help);
        // Whoever asks for help gets it, whatever else is wrong.
        EXPECT_EQ(succeeded(folder, test::joined(command.path, {"--bogus", "--help"})).out, help);
        EXPECT_TRUE(std::regex_search(
            help, std::regex("^.+\n\nExamples?:\n(  .+\n)+\nUsage: " + name_of(command) + " ")))
            << help;
    }
    test::expect_said(succeeded(folder, {"help", "script"}).out, "4..60 advance 2 mm");
}

TEST_F(Commands, PrintJsonThatSaysWhatTheTextSays) {
    using Json = nlohmann::json;
    const auto asked = [&](const Words& words) {
        const Outcome made = succeeded(folder, words);
        EXPECT_TRUE(
            std::ranges::all_of(made.out, [](char c) { return c == '\n' || (c >= ' ' && c <= '~'); }));
        const Json json = Json::parse(made.out, nullptr, false);
        EXPECT_FALSE(json.is_discarded()) << made.out;
        EXPECT_EQ(json.value("schema", 0), 1);
        return json;
    };
    const Json exercises = asked({"list", "--json"})["exercises"];
    EXPECT_EQ(exercises[0]["name"], "first_steps");
    const auto renal =
        std::ranges::find(exercises, Json("renal"), [](const Json& one) { return one["name"]; });
    ASSERT_NE(renal, exercises.end());
    EXPECT_GT((*renal)["skilled_s"], 1);
    EXPECT_TRUE(std::filesystem::exists((*renal)["solution"].get<std::string>()));
    EXPECT_EQ(asked({"list", "devices", "--json"})["devices"][0]["name"], "amplatzS035");
    const Json straight = asked({"list", "straight", "--json"});
    EXPECT_EQ(straight["name"], "straight");
    EXPECT_EQ(straight["refused"], nullptr);
    EXPECT_GT(straight["target"]["radius_mm"], 0);
    EXPECT_FALSE(straight["branches"].empty());

    succeeded(folder, {"run", "straight", "--commands", "solution", "--out", folder / "all/one", "--frames",
                       "none", "--learner", "Zoë"});
    const std::string recording = folder / "all/one/run.gw";
    const Json scored = asked({"score", recording, "--json", "--out", folder / "score.json"});
    ASSERT_EQ(scored["recordings"].size(), 1u);
    EXPECT_EQ(scored["recordings"][0]["file"], recording);
    EXPECT_EQ(scored["recordings"][0]["score"], Json::parse(read(folder / "score.json")));
    EXPECT_EQ(scored["recordings"][0]["score"]["learner"], "Zoë");
    EXPECT_EQ(scored["recordings"][0]["differences"], Json::array());
    write(folder / "all/two.gw", "schema\n");
    const Outcome some = run(folder, {"score", folder / "all", "--json"});
    EXPECT_EQ(some.code, 2);
    const Json both = Json::parse(some.out)["recordings"];
    EXPECT_EQ(both.size(), 2u);
    EXPECT_EQ(std::ranges::count_if(both, [](const Json& one) { return one["error"].is_null(); }), 1);

    const Json course = asked({"course", folder / "all", "--json", "--cache", folder / "cache"})["attempts"];
    const std::string csv = read(folder / "all/course.csv");
    ASSERT_EQ(course.size(), 2u);
    EXPECT_EQ(course[0]["learner"], "Zoë");
    EXPECT_EQ(course[0]["reached"], true);
    EXPECT_EQ(course[1]["reached"], nullptr);
    std::istringstream head(csv.substr(0, csv.find('\n')));
    std::size_t columns = 0;
    for (std::string column; std::getline(head, column, ','); ++columns)
        EXPECT_TRUE(course[0].contains(column)) << column;
    EXPECT_EQ(course[0].size(), columns);

    succeeded(folder, {"list", "renal", "--cache", folder / "cache"});
    const Json kept = asked({"cache", "list", "--json", "--cache", folder / "cache"});
    ASSERT_FALSE(kept["items"].empty());
    const Json cleared = asked({"cache", "clear", "--json", "--cache", folder / "cache"});
    EXPECT_EQ(cleared["removed"].size(), kept["items"].size());
}

TEST_F(Commands, AreCompletedInBash) {
    write(folder / "seldinger.bash", succeeded(folder, {"completion", "bash"}).out);
    std::filesystem::create_directory(folder / "mine");
    write(folder / "ask.bash", R"(
source seldinger.bash
ask() {
    COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
    _seldinger
    echo "${COMPREPLY[*]}"
}
)");
    const auto completed = [&](const std::string& words) {
        const std::string script = "source ./ask.bash; ask '" + std::string(SELDINGER_PROGRAM) + "' " + words;
        const Outcome result = Started(folder, {"bash", "--norc", "-c", script}).wait();
        EXPECT_EQ(result.error, "") << words;
        return result.out;
    };
    EXPECT_EQ(completed("re"), "replay render relax\n");
    EXPECT_EQ(completed("run re"), "renal_right renal renal_timed renal_low_dose renal_cobra renal_stent\n");
    EXPECT_EQ(completed("run renal --fr"), "--frames\n");
    EXPECT_EQ(completed("run renal --frames ''"), "all none\n");
    EXPECT_EQ(completed("run renal --set guidewire.friction=1 --tru"), "--truth --truth-of\n");
    EXPECT_EQ(completed("run renal --out mi"), "mine\n");
    EXPECT_EQ(completed("anatomy ''"), "generate import check export show voxelise\n");
    EXPECT_EQ(completed("anatomy generate ili"), "iliac-renal\n");
    EXPECT_EQ(completed("device show cobra"), "cobra4f cobra5f\n");
    EXPECT_EQ(completed("study accu"), "accuracy\n");
    EXPECT_EQ(completed("study al"), "all\n");
    EXPECT_EQ(completed("help sc"), "score script\n");
    EXPECT_EQ(completed("run renal --every ''"), "\n");
    for (const KnownCommand& command : all_commands()) {
        std::string words;
        for (const std::string& word : command.path) words += word + " ";
        const std::string options = " " + completed(words + "-");
        for (const KnownOption& option : command.options)
            test::expect_said(options, " " + option.name.substr(option.name.rfind("--")));
    }
}

/// What a script says of each option of each command.
void expect_options(const std::string& script) {
    for (const KnownCommand& command : all_commands())
        for (const KnownOption& option : command.options)
            test::expect_said(script, option.name.substr(option.name.rfind("--") + 2));
}

bool has(const test::TemporaryFolder& folder, const std::string& shell) {
    return Started(folder, {"bash", "-c", "command -v " + shell}).wait().code == 0;
}

TEST_F(Commands, AreCompletedInZsh) {
    const std::string script = succeeded(folder, {"completion", "zsh"}).out;
    expect_options(script);
    if (!has(folder, "zsh")) GTEST_SKIP() << "zsh was not found: apt-get install zsh";
    write(folder / "_seldinger", script);
    std::filesystem::create_directory(folder / "mine");
    // Typed at a terminal; a key writes what zsh would show for the line into a file.
    write(folder / "shell.zsh", R"(
PS1= fpath=($PWD $fpath)
autoload -Uz compinit
compinit -u -D
offers() {
    local -aU all
    compadd() {
        local -a offered
        [[ " $*" == *\ -[OAD]\ * ]] || builtin compadd -A offered "$@"
        all+=($offered)
        builtin compadd "$@"
    }
    _main_complete
    print -r -- $all >offers
}
zle -C offers list-choices offers
bindkey '^T' offers
)");
    write(folder / "ask.zsh", R"(
zmodload zsh/zpty
zpty shell zsh -f -i
zpty -w shell 'source ./shell.zsh; print READY $((1 + 1))'
zpty -r shell shown '*READY 2*'
zpty -w -n shell "$1"$'\x14'
repeat 200; do
    zpty -r -t shell shown
    [[ -f offers && $(wc -l <offers) -gt 0 ]] && break
    sleep 0.05
done
cat offers
rm offers
)");
    const auto completed = [&](const std::string& words) {
        const Outcome result =
            Started(folder, {"zsh", "-f", "ask.zsh", std::string(SELDINGER_PROGRAM) + " " + words}).wait();
        EXPECT_EQ(result.error, "") << words;
        return result.out;
    };
    EXPECT_EQ(completed("re"), "replay render relax\n");
    EXPECT_EQ(completed("run re"), "renal_right renal renal_timed renal_low_dose renal_cobra renal_stent\n");
    EXPECT_EQ(completed("run renal --fr"), "--frames\n");
    EXPECT_EQ(completed("run renal --frames "), "all none\n");
    EXPECT_EQ(completed("run renal --every "), "\n");
    EXPECT_EQ(completed("run renal --out mi"), "mine\n");
    EXPECT_EQ(completed("anatomy generate ili"), "iliac-renal\n");
    EXPECT_EQ(completed("device show cobra"), "cobra4f cobra5f\n");
    EXPECT_EQ(completed("study accu"), "accuracy\n");
}

TEST_F(Commands, AreCompletedInFish) {
    const std::string script = succeeded(folder, {"completion", "fish"}).out;
    expect_options(script);
    if (!has(folder, "fish")) GTEST_SKIP() << "fish was not found: apt-get install fish";
    write(folder / "seldinger.fish", script);
    std::filesystem::create_directory(folder / "mine");
    const auto completed = [&](const std::string& words) {
        const std::string ask = "source seldinger.fish; complete -C '" + std::string(SELDINGER_PROGRAM) +
                                " " + words + "' | string split -f 1 \\t | string join ' '";
        const Outcome result = Started(folder, {"fish", "--no-config", "-c", ask}).wait();
        EXPECT_EQ(result.error, "") << words;
        return result.out;
    };
    EXPECT_EQ(completed("re"), "relax render replay\n");
    EXPECT_EQ(completed("run re"), "renal renal_cobra renal_low_dose renal_right renal_stent renal_timed\n");
    EXPECT_EQ(completed("run renal --fr"), "--frames\n");
    EXPECT_EQ(completed("run renal --frames "), "all none\n");
    EXPECT_EQ(completed("run renal --every "), "");
    EXPECT_EQ(completed("run renal --out "), "mine/\n");
    EXPECT_EQ(completed("anatomy "), "check export generate import show voxelise\n");
    EXPECT_EQ(completed("anatomy generate "),
              "aorta arch-1 arch-2 arch-3 arch-arms arch-bovine arch-lca cerebral circle femoral iliac-renal "
              "lca rca\n");
    EXPECT_EQ(completed("device show cobra"), "cobra4f cobra5f\n");
    EXPECT_EQ(completed("study accu"), "accuracy\n");
}

TEST_F(Commands, EndQuietlyWhereTheirReaderHasLeft) {
    for (const char* words : {"list", "run --help", "list devices --json", "author straight"}) {
        SCOPED_TRACE(words);
        // Beyond what a pipe holds, or at the end.
        const std::string script =
            "'" + std::string(SELDINGER_PROGRAM) + "' " + words + " | true; echo ${PIPESTATUS[0]}";
        const Outcome result = Started(folder, {"bash", "-c", "sleep 0; " + script}).wait();
        EXPECT_EQ(result.error, "");
        // Whether the reader leaves before or after so little is written is its own affair.
        EXPECT_TRUE(result.out == "141\n" || result.out == "0\n") << result.out;
    }
    const Outcome full =
        Started(folder, {"bash", "-c", "'" + std::string(SELDINGER_PROGRAM) + "' list >/dev/full"}).wait();
    EXPECT_EQ(full.code, 2);
    test::expect_said(full.error, "standard output: No space left on device");
    const Outcome served = Started(folder, {"bash", "-c",
                                            "yes step | '" + std::string(SELDINGER_PROGRAM) +
                                                "' serve straight | head -n 1 >/dev/null; echo "
                                                "${PIPESTATUS[1]}"})
                               .wait();
    EXPECT_EQ(served.out, "141\n");
    EXPECT_EQ(served.error, "");
}

TEST_F(Commands, TakeTheSolutionAndStandardInputAsScriptsWhereverTheyTakeScripts) {
    const std::string solution = read(test::asset("scripts/straight.gw"));
    succeeded(folder, {"show", "straight", "--commands", "solution", "--out", folder / "named.png"});
    succeeded(folder, {"show", "straight", "--out", folder / "usual.png"});
    EXPECT_EQ(read(folder / "named.png"), read(folder / "usual.png"));
    write(folder / "typed.gw", solution);
    const auto typed = [&](const std::string& words) {
        const std::string script = "'" + std::string(SELDINGER_PROGRAM) + "' " + words + " <typed.gw";
        const Outcome result = Started(folder, {"bash", "-c", script}).wait();
        EXPECT_EQ(result.code, 0) << result.error;
    };
    typed("show straight --commands - --out typed.png");
    EXPECT_EQ(read(folder / "typed.png"), read(folder / "usual.png"));
    succeeded(folder,
              {"render", "straight", "--commands", "solution", "--frame", "9", "--out", folder / "a.png"});
    typed("render straight --commands - --frame 9 --out b.png");
    EXPECT_EQ(read(folder / "a.png"), read(folder / "b.png"));
}

TEST_F(Commands, RefuseKeysOfALaterVersionBeforeAnyWork) {
    std::filesystem::copy(std::filesystem::path(SELDINGER_SOURCE) / "assets", folder / "assets",
                          std::filesystem::copy_options::recursive);
    std::string keys = read(test::asset("keys.toml"));
    keys.replace(keys.find("schema = 1"), 10, "schema = 2");
    write(folder / "assets/keys.toml", keys);
    const std::string line = std::to_string(
        1 + std::count(keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(keys.find("schema")), '\n'));
    for (const Words& words :
         std::vector<Words>{{"author", "renal"}, {"benchmark", "--played", "1", "--of", "renal"}}) {
        const Outcome result =
            Started(folder, test::joined({"env", "SELDINGER_ASSETS=" + (folder / "assets").string(),
                                          "XDG_DATA_HOME=" + folder.path().string()},
                                         test::command(words)))
                .wait();
        EXPECT_EQ(result.code, 2);
        EXPECT_EQ(result.error.find('%'), std::string::npos) << "work was begun: " << result.error;
        test::expect_said(result.error,
                          "keys.toml:" + line + ":10: schema 2 is of a later version; this program reads 1");
    }
}

}  // namespace app

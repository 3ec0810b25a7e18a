/// Who may include whom: every #include of the tree against the arrows of docs/architecture.md.

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gtest/gtest.h>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>

namespace {

namespace fs = std::filesystem;
using Names = std::set<std::string>;

/// Which rooms a room may include besides itself, and which namespace is its own.
struct Room {
    Names rooms;
    std::string space;
};

Names unclear;  // words of the table that mean no room, or several

/// The table of docs/architecture.md, whose rows are "| `room` | `namespace` | subject | may include |".
std::map<std::string, Room> rooms_of(const std::string& document) {
    const std::regex row(R"(\| `([a-z_/]+)` \| `(\w+)` \| .* \| ([^|]*) \|)");
    std::map<std::string, Room> found;
    std::map<std::string, std::string> columns;
    std::istringstream text(document);
    for (std::string line; std::getline(text, line);) {
        std::smatch match;
        if (!std::regex_match(line, match, row)) continue;
        found[match[1]].space = match[2];
        columns[match[1]] = match[3];
    }
    for (const auto& [room, column] : columns) {
        if (column == "–") continue;
        std::istringstream words(column);
        for (std::string word; std::getline(words >> std::ws, word, ',');) {
            const bool group = word == "physics" || word == "render";
            Names meant;
            for (const auto& [other, ignored] : found)
                if (other == word || other.ends_with("/" + word) || (group && other.starts_with(word + "/")))
                    meant.insert(other);
            if (group ? meant.size() < 2 : meant.size() != 1) unclear.insert(room + ": " + word);
            found[room].rooms.insert(meant.begin(), meant.end());
        }
    }
    return found;
}

std::string architecture() {
    std::ostringstream text;
    text << std::ifstream(fs::path(SELDINGER_SOURCE) / "docs/architecture.md").rdbuf();
    return text.str();
}

const std::map<std::string, Room> rooms = rooms_of(architecture());

/// Third-party headers, by the first part of their path: where they may be included. A room is named for its
/// .cpp files alone, a file for itself; "" is everywhere.
const std::map<std::string, Names> third_party = {
    {"Eigen", {""}},
    {"unsupported", {"engine/exercise"}},  // Eigen's Fourier transform
    {"embree3", {"physics/geometry/embree_mesh.h"}},
    {"embree4", {"physics/geometry/embree_mesh.h"}},
    {"EGL", {"render/picture/gl_egl.cpp"}},
    {"png.h", {"render/picture"}},
    {"zlib.h", {"engine/patient"}},
    {"bzlib.h", {"engine/patient"}},
    {"nifti1.h", {"engine/patient"}},
    {"nifti2_io.h", {"engine/patient"}},
    {"openjpeg.h", {"engine/patient"}},
    {"dcmtk", {"engine/dicom", "engine/patient", "engine/patient/dicom_data.h"}},
    {"openssl", {"app/signature.cpp"}},
    {"libdeflate.h", {"engine/anatomy", "render/picture"}},
    {"pugixml.hpp", {"engine/anatomy", "engine/anatomy/import"}},
    {"GL", {"app/play/gl.h", "render/picture/gl_context.h", "render/picture/gl_osmesa.cpp"}},
    {"emscripten.h", {"app/web"}},
    {"glm", {"app/play", "render/xray", "render/xray/gl_camera.h"}},
    {"imgui.h", {"app/play", "app/play/theme.h", "render/panel"}},
    {"backends", {"app/play"}},  // of ImGui
    {"GLFW", {"app/play", "app/play/gl.h"}},
    {"assimp", {"engine/anatomy"}},
    {"toml++",
     {"engine/anatomy/grow", "engine/debrief", "engine/io", "engine/plan", "engine/room", "engine/run",
      "engine/scenario"}},
    {"nlohmann",
     {"app", "app/web", "app/json.h", "app/web/page_json.h", "engine/debrief", "engine/anatomy",
      "engine/anatomy/grow", "engine/anatomy/import", "engine/episode", "engine/exercise", "engine/plan",
      "engine/room", "engine/run", "engine/studies"}},
    {"seccomp.h", {"engine/io"}},
    {"CLI", {"app", "app/arguments.h"}},
    {"pybind11", {"app/python", "app/python/episodes.h", "app/python/values.h"}},
};
const Names with_fmt = {"engine", "app"};  // folders
const Names posix = {"fcntl.h",     "semaphore.h",    "spawn.h",       "sys/file.h", "pthread.h",
                     "sys/mman.h",  "sys/random.h",   "sys/stat.h",    "sys/wait.h", "unistd.h",
                     "sys/prctl.h", "sys/resource.h", "sys/syscall.h", "sys/auxv.h", "malloc.h"};

std::string folder_of(const std::string& file) {
    return file.substr(0, file.rfind('/'));
}

bool is_source(const std::string& file) {
    return file.ends_with(".cpp");
}

/// `file` and `included` as they stand in an #include, from the root.
bool allowed(const std::string& file, const std::string& included) {
    const std::string room = folder_of(file), first = included.substr(0, included.find('/'));
    if (first == "physics" || first == "render" || first == "engine" || first == "app") {
        // They bring the headers of Embree and OpenGL.
        if (included == "physics/geometry/embree_mesh.h" || included == "render/picture/gl_context.h") {
            if (!is_source(file)) return false;
        }
        if (included.ends_with("embree_mesh.h") && room != "physics/geometry" && room != "physics/wall" &&
            room != "engine/studies")
            return false;
        const std::string other = folder_of(included);
        // Within the program only the file that runs the studies knows them.
        if (other == "engine/studies" && room == "app" && file != "app/study_main.cpp") return false;
        return other == room || rooms.at(room).rooms.contains(other);
    }
    if (included.find_first_of("/.") == std::string::npos || posix.contains(included)) return true;
    if (first == "fmt") return with_fmt.contains(file.substr(0, file.find('/')));
    const auto found = third_party.find(first);
    if (found == third_party.end()) return false;
    const Names& where = found->second;
    return where.contains("") || where.contains(file) || (is_source(file) && where.contains(room));
}

/// Calls visit(file from the root, number, line) for every line of the rooms' sources.
int for_each_line(const std::function<void(const std::string&, int, const std::string&)>& visit,
                  std::initializer_list<const char*> folders = {"physics", "render", "engine", "app"}) {
    int files = 0;
    const fs::path root(SELDINGER_SOURCE);
    for (const char* folder : folders) {
        for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
            const std::string extension = entry.path().extension().string();
            if (extension != ".h" && extension != ".cpp") continue;
            // What browsers lack: it has the names and the namespaces of what it stands for.
            if (entry.path().parent_path().generic_string().find("app/web/stand_in") != std::string::npos)
                continue;
            ++files;
            std::ifstream text(entry.path());
            const std::string file = fs::relative(entry.path(), root).generic_string();
            std::string line;
            for (int number = 1; std::getline(text, line); ++number) visit(file, number, line);
        }
    }
    return files;
}

const std::regex include_line(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");

}  // namespace

TEST(Layering, EveryIncludeFollowsTheArrows) {
    int includes = 0;
    const int files = for_each_line([&](const std::string& file, int number, const std::string& line) {
        ASSERT_TRUE(rooms.contains(folder_of(file))) << file << " stands in no room";
        std::smatch match;
        if (!std::regex_search(line, match, include_line)) return;
        ++includes;
        EXPECT_TRUE(allowed(file, match[1])) << file << ":" << number << ": may not include " << match[1];
    });
    EXPECT_GT(files, 250);
    EXPECT_GT(includes, 1000);
}

TEST(Layering, TheTableIsThatOfTheDocument) {
    for (const std::string& word : unclear)
        ADD_FAILURE() << word << " means no room of the table, or several";
    EXPECT_GE(rooms.size(), 25u);
    EXPECT_EQ(rooms.at("render/xray").rooms, (Names{"physics/geometry", "render/picture"}));
    EXPECT_EQ(rooms.at("physics/relax").rooms, (Names{"physics/geometry", "physics/wall", "physics/wire"}));
    EXPECT_TRUE(rooms.at("physics/geometry").rooms.empty());
    EXPECT_EQ(rooms.at("engine/run").space, "run");
}

TEST(Layering, ArrowsOfTheTableGoDownwardsAlone) {
    // A room's floor is above all floors that it may include; a circle would have none.
    std::map<std::string, int> floor;
    std::function<int(const std::string&, int)> floor_of = [&](const std::string& room, int depth) {
        EXPECT_LT(depth, 30) << room << " includes itself in a circle";
        if (depth >= 30) return 0;
        if (const auto known = floor.find(room); known != floor.end()) return known->second;
        int highest = -1;
        for (const std::string& other : rooms.at(room).rooms)
            highest = std::max(highest, floor_of(other, depth + 1));
        return floor[room] = highest + 1;
    };
    for (const auto& [room, ignored] : rooms) floor_of(room, 0);
    EXPECT_EQ(floor["physics/geometry"], 0);
    EXPECT_GT(floor["engine/exercise"], floor["engine/scenario"]);
}

TEST(Layering, EveryRoomHasItsNamespace) {
    const std::regex opens(R"(^namespace (\w+)[\w:]* \{)");
    const Names forward = {"io"};  // whose classes other rooms name ahead
    std::map<std::string, int> found;
    for_each_line([&](const std::string& file, int number, const std::string& line) {
        std::smatch match;
        if (!std::regex_search(line, match, opens)) return;
        if (match[1] == rooms.at(folder_of(file)).space)
            ++found[folder_of(file)];
        else
            EXPECT_TRUE(forward.contains(match[1]) || match[1] == "toml")
                << file << ":" << number << ": " << line;
    });
    for (const auto& [room, ignored] : rooms) EXPECT_GT(found[room], 0) << room;
}

TEST(Layering, StatesUseNoFunctionWhoseBitsAreTheSystems) {
    // Those of physics/geometry/maths.h have the same bits everywhere.
    const std::regex calls(
        R"(std::(sin|cos|tan|asin|acos|atan|atan2|sinh|cosh|tanh|hypot|exp|exp2|expm1|log|log2|log10|log1p|pow|cbrt|erf|polar|arg)\()");
    const std::regex turns("AngleAxis|[a-z]+_distribution");
    int seen = 0;
    for_each_line([&](const std::string& file, int number, const std::string& line) {
        const std::string room = folder_of(file);
        const bool of_states = room.starts_with("physics/") || room == "engine/scenario" ||
                               room == "engine/blood" || room == "engine/exercise" ||
                               room.starts_with("engine/anatomy");
        if (!of_states) return;
        ++seen;
        EXPECT_FALSE(std::regex_search(line, calls)) << file << ":" << number << ": " << line;
        EXPECT_FALSE(std::regex_search(line, turns)) << file << ":" << number << ": " << line;
    });
    EXPECT_GT(seen, 10'000);
}

TEST(Layering, TestsNameTheRelaxerThatTheyMean) {
    // A default that changed has made two tests compare a relaxer with itself.
    const std::string unnamed = std::string("make_relaxer") + "({})";
    for_each_line(
        [&](const std::string& file, int number, const std::string& line) {
            EXPECT_EQ(line.find(unnamed), std::string::npos) << file << ":" << number;
        },
        {"tests"});
}

TEST(Layering, CommandsPrintThroughOneDoor) {
    // print() takes control characters out; write_out() is for JSON, which has none, and for shells.
    const std::regex prints(R"((fmt::print\(|std::cout|std::printf|[^f]puts\(|stdout))");
    for_each_line(
        [&](const std::string& file, int number, const std::string& line) {
            if (folder_of(file) != "app" || file == "app/command.h") return;
            if (line.find("fflush(stdout)") != std::string::npos) return;
            if (file == "app/command.cpp" && line.find("ferror(stdout)") != std::string::npos) return;
            EXPECT_FALSE(std::regex_search(line, prints)) << file << ":" << number << ": " << line;
        },
        {"app"});
}

TEST(Layering, FilesAreWrittenThroughOneDoor) {
    const char* const words[] = {
        "ofstream",         "fstream ",          "filebuf",    "fopen(",      "freopen(",
        "fdopen(",          "O_WRONLY",          "O_RDWR",     "O_CREAT",     "O_TRUNC",
        "O_APPEND",         "::creat(",          "mkdir",      "mkstemp",     "mkostemp",
        "mkdtemp",          "tmpfile(",          "mkfifo",     "mknod",       "create_director",
        "create_hard_link", "create_symlink",    "::symlink(", "::link(",     "rename(",
        "copy_file",        "filesystem::copy(", "fs::copy(",  "resize_file", "truncate(",
        "saveFile",         "png_init_io",       "gzopen",
    };
    int seen = 0;
    for_each_line([&](const std::string& file, int number, const std::string& line) {
        const bool found = std::ranges::any_of(words, [&](const char* word) {
            const std::size_t at = line.find(word);
            const auto part_of_word = [](char c) {
                return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
            };
            return at != std::string::npos && (at == 0 || word[0] == ':' || !part_of_word(line[at - 1]));
        });
        if (folder_of(file) == "engine/io") return void(seen += found);
        // Closed standard streams are opened before anything else is.
        if (file == "app/command.cpp" && line.find("\"/dev/null\"") != std::string::npos) return;
        EXPECT_FALSE(found) << file << ":" << number << ": " << line;
    });
    EXPECT_GT(seen, 10);
}

TEST(Layering, RulesRefuseWhatTheyShould) {
    EXPECT_FALSE(allowed("physics/wire/energy.cpp", "boost/array.hpp"));
    EXPECT_FALSE(allowed("engine/io/csv.cpp", "sqlite3.h"));
    EXPECT_TRUE(allowed("engine/io/files.cpp", "unistd.h"));
    EXPECT_FALSE(allowed("physics/wire/energy.cpp", "render/picture/image.h"));
    EXPECT_FALSE(allowed("physics/wire/energy.cpp", "physics/relax/relaxer.h"));
    EXPECT_FALSE(allowed("physics/geometry/mesh_query.cpp", "physics/wall/wall.h"));
    EXPECT_FALSE(allowed("physics/wire/energy.cpp", "embree3/rtcore.h"));
    EXPECT_TRUE(allowed("physics/wall/mesh_wall.cpp", "physics/geometry/embree_mesh.h"));
    EXPECT_FALSE(allowed("physics/wall/mesh_wall.h", "physics/geometry/embree_mesh.h"));
    EXPECT_FALSE(allowed("physics/wire/energy.cpp", "fmt/format.h"));
    EXPECT_FALSE(allowed("render/picture/image.cpp", "physics/wire/chain.h"));
    EXPECT_FALSE(allowed("render/picture/image.cpp", "render/xray/c_arm.h"));
    EXPECT_TRUE(allowed("render/xray/c_arm.cpp", "physics/geometry/vec.h"));
    EXPECT_FALSE(allowed("render/xray/path_length.h", "render/picture/gl_context.h"));
    EXPECT_FALSE(allowed("render/picture/png.h", "png.h"));
    EXPECT_FALSE(allowed("render/panel/canvas.h", "imgui.h"));
    EXPECT_FALSE(allowed("render/picture/image.cpp", "engine/exercise/score.h"));
    EXPECT_FALSE(allowed("engine/scenario/scenario.h", "toml++/toml.h"));
    EXPECT_FALSE(allowed("engine/scenario/scenario.cpp", "app/command.h"));
    EXPECT_FALSE(allowed("engine/scenario/scenario.cpp", "engine/exercise/simulation.h"));
    EXPECT_FALSE(allowed("engine/run/headless.cpp", "engine/studies/study.h"));
    EXPECT_FALSE(allowed("engine/anatomy/anatomy.cpp", "engine/anatomy/grow/generator.h"));
    EXPECT_FALSE(allowed("engine/exercise/simulation.cpp", "embree3/rtcore.h"));
    EXPECT_FALSE(allowed("app/main.cpp", "physics/wire/chain.h"));
    EXPECT_FALSE(allowed("app/run_command.cpp", "engine/studies/study.h"));
    EXPECT_TRUE(allowed("app/study_main.cpp", "engine/studies/study.h"));
}

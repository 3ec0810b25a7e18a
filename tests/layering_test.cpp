/// Who may include whom: every #include of the tree against the arrows of the design.

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <map>
#include <regex>
#include <set>
#include <string>

namespace {

namespace fs = std::filesystem;

struct Layer {
    std::set<std::string> folders;                         // of the project that it may include
    std::set<std::string> third_party;                     // first part of a third-party path, anywhere
    std::map<std::string, std::set<std::string>> only_in;  // third-party path → files (.cpp) that alone may
};

const std::set<std::string> posix = {"fcntl.h", "sys/wait.h", "unistd.h"};

/// Of the language: neither a folder nor an ending.
bool standard(const std::string& included) {
    return included.find_first_of("/.") == std::string::npos;
}

const std::map<std::string, Layer> layers = {
    {"physics", {{"physics"}, {"Eigen"}, {{"embree3", {"embree_mesh.h"}}}}},
    {"render",
     {{"render"},
      {"Eigen"},
      {{"png.h", {"*.cpp"}},
       {"libdeflate.h", {"*.cpp"}},
       {"imgui.h", {"*.cpp"}},
       {"GL", {"gl_context.h", "offscreen.cpp"}}}}},
    {"engine",
     {{"engine", "render", "physics"},
      {"Eigen"},
      {{"assimp", {"*.cpp"}}, {"toml++", {"*.cpp"}}, {"nlohmann", {"*.cpp"}}, {"fmt", {"*.cpp"}}}}},
    {"app", {{"app", "engine"}, {"CLI", "fmt"}, {}}},
};

bool allowed(const std::string& folder, const std::string& file, const std::string& included) {
    const Layer& layer = layers.at(folder);
    const std::string first = included.substr(0, included.find('/'));
    if (layers.contains(first)) {
        // Of the physics, render borrows one header of plain data.
        if (folder == "render" && included == "physics/geometry.h") return true;
        // They bring headers of Embree and OpenGL.
        const bool brings = included == "physics/embree_mesh.h" || included == "render/gl_context.h";
        if (brings && !file.ends_with(".cpp")) return false;
        return layer.folders.contains(first);
    }
    if (standard(included) || posix.contains(included)) return true;
    if (layer.third_party.contains(first)) return true;
    const auto files = layer.only_in.find(first);
    if (files == layer.only_in.end()) return false;
    return files->second.contains(file) || (files->second.contains("*.cpp") && file.ends_with(".cpp"));
}

}  // namespace

TEST(Layering, EveryIncludeFollowsTheArrows) {
    const std::regex include(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");
    int files = 0, includes = 0;
    for (const auto& [folder, layer] : layers) {
        for (const auto& entry : fs::recursive_directory_iterator(fs::path(SELDINGER_SOURCE) / folder)) {
            const std::string extension = entry.path().extension().string();
            if (extension != ".h" && extension != ".cpp") continue;
            ++files;
            std::ifstream text(entry.path());
            std::string line;
            for (int number = 1; std::getline(text, line); ++number) {
                std::smatch match;
                if (!std::regex_search(line, match, include)) continue;
                ++includes;
                EXPECT_TRUE(allowed(folder, entry.path().filename().string(), match[1]))
                    << entry.path().string() << ":" << number << ": " << folder << " may not include "
                    << match[1];
            }
        }
    }
    EXPECT_GT(files, 40);
    EXPECT_GT(includes, 200);
}

TEST(Layering, TestsNameTheRelaxerThatTheyMean) {
    // A default that changed has made two tests compare a relaxer with itself.
    const std::string unnamed = std::string("make_relaxer") + "({})";
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(SELDINGER_SOURCE) / "tests")) {
        const std::string extension = entry.path().extension().string();
        if (extension != ".h" && extension != ".cpp") continue;
        std::ifstream text(entry.path());
        std::string line;
        for (int number = 1; std::getline(text, line); ++number)
            EXPECT_EQ(line.find(unnamed), std::string::npos) << entry.path().string() << ":" << number;
    }
}

TEST(Layering, RulesRefuseWhatTheyShould) {
    EXPECT_FALSE(allowed("physics", "energy.cpp", "boost/array.hpp"));
    EXPECT_FALSE(allowed("engine", "table.cpp", "sqlite3.h"));
    EXPECT_TRUE(allowed("engine", "files.cpp", "unistd.h"));
    EXPECT_FALSE(allowed("physics", "energy.cpp", "render/image.h"));
    EXPECT_FALSE(allowed("physics", "energy.cpp", "embree3/rtcore.h"));
    EXPECT_TRUE(allowed("physics", "mesh_wall.cpp", "physics/embree_mesh.h"));
    EXPECT_FALSE(allowed("physics", "mesh_wall.h", "physics/embree_mesh.h"));
    EXPECT_FALSE(allowed("physics", "energy.cpp", "fmt/format.h"));
    EXPECT_FALSE(allowed("render", "image.cpp", "physics/guidewire.h"));
    EXPECT_TRUE(allowed("render", "image.cpp", "physics/geometry.h"));
    EXPECT_FALSE(allowed("render", "path_length.h", "render/gl_context.h"));
    EXPECT_FALSE(allowed("render", "png.h", "png.h"));
    EXPECT_FALSE(allowed("render", "canvas.h", "imgui.h"));
    EXPECT_FALSE(allowed("render", "image.cpp", "engine/score.h"));
    EXPECT_FALSE(allowed("engine", "scenario.h", "toml++/toml.h"));
    EXPECT_FALSE(allowed("engine", "scenario.cpp", "app/main.h"));
    EXPECT_FALSE(allowed("engine", "simulation.cpp", "embree3/rtcore.h"));
    EXPECT_FALSE(allowed("app", "main.cpp", "physics/guidewire.h"));
}

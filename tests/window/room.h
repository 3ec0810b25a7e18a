#pragma once
/// The real window on a display of its own, and what it leaves.

#include <csignal>
#include <cstdlib>
#include <fmt/format.h>
#include <functional>
#include <gtest/gtest.h>
#include <optional>
#include <sys/resource.h>

#include "engine/script/command.h"
#include "render/panel/palette.h"
#include "render/picture/png.h"
#include "tests/app/program.h"
#include "tests/window/display.h"

namespace test {

inline constexpr double long_enough = 300;              // [s]; nothing here waits for as long unless it fails
inline constexpr render::Ink button_ink{35, 70, 110};   // of the buttons of a page
inline constexpr render::Ink marked_ink{66, 150, 250};  // of the one that the keys have reached

/// The first and the last column with pixels of this colour; -1 where there are none.
inline std::pair<int, int> columns_of(const render::ColourImage& image, render::Ink ink, int top = 0) {
    std::pair<int, int> columns{-1, -1};
    for (int x = 0; x < image.width; ++x)
        for (int y = top; y < image.height; ++y) {
            const std::uint8_t* pixel = &image.pixels[3 * (static_cast<std::size_t>(y) * image.width + x)];
            if (pixel[0] == ink.red && pixel[1] == ink.green && pixel[2] == ink.blue)
                columns = {columns.first < 0 ? x : columns.first, x};
        }
    return columns;
}

/// The program in the room, its files in a folder of its own; vessels come from the cache of all tests.
class Room {
public:
    /// `largest_file`: the largest that the program can write, as on a full disk [bytes]; `beside`: what the
    /// display is wider than the window [pixels].
    Room(int width, int height, std::vector<std::string> words, std::optional<rlim_t> largest_file = {},
         int beside = 0)
        : display(width + beside, height) {
        setenv("DISPLAY", display.name().c_str(), 1);
        setenv("XDG_DATA_HOME", (folder / "data").c_str(), 1);
        setenv("XDG_CONFIG_HOME", (folder / "config").c_str(), 1);
        words.insert(words.begin(), "play");
        words.insert(words.end(), {"--size", fmt::format("{}x{}", width, height), "--cache",
                                   std::string(SELDINGER_SOURCE) + "/build/cache"});
        for (std::string& word : words)
            if (word.starts_with("@")) word = (folder / word.substr(1)).string();
        rlimit before{};
        getrlimit(RLIMIT_FSIZE, &before);
        ::signal(SIGXFSZ, SIG_IGN);
        const rlimit limited{largest_file.value_or(before.rlim_cur), before.rlim_max};
        setrlimit(RLIMIT_FSIZE, &limited);  // limits this process, and what it starts inherits the limit
        program.emplace(folder, command(words));
        setrlimit(RLIMIT_FSIZE, &before);
    }
    ~Room() {
        if (program) program->signal(SIGKILL);
    }

    /// Waits for what the program shows or writes, however busy the machine is.
    bool comes(const std::string& what, const std::function<bool()>& has_come) {
        const bool came = wait_until(has_come, long_enough);
        EXPECT_TRUE(came) << what << " did not come; the title is '" << display.title() << "'";
        return came;
    }
    bool reaches(const std::string& title) {
        return comes("'" + title + "'", [&] { return display.find(title); });
    }
    /// Until the recording holds these words; `file` as for --record.
    bool records(const std::filesystem::path& file, const std::string& words) {
        return comes("'" + words + "' in " + file.string(),
                     [&] { return read(file).find(words) != std::string::npos; });
    }
    /// Taps a key of a page until it has acted: the page does not see a tap that falls between two of its
    /// drawings, and one that it has seen acts with the next.
    bool tap_until(const char* key, const std::string& what, const std::function<bool()>& has_come) {
        return comes(what + " by " + key, [&] {
            display.tap(key);
            return wait_until(has_come, 3);
        });
    }
    bool tap_out_of(const std::string& title, const char* key) {
        return tap_until(key, "the end of '" + title + "'", [&] { return !display.find(title); });
    }
    /// Columns of the marked button, the first and the last; those of one picture that stays.
    std::pair<int, int> marked() {
        std::pair<int, int> columns{-1, -1}, before;
        do {
            before = columns;
            columns = columns_of(display.screenshot(), marked_ink);
        } while (columns != before);
        return columns;
    }
    bool mark_next(const char* key) {
        const auto before = marked();
        return tap_until(key, "the mark on another button", [&] {
            const auto now = marked();
            return now.first >= 0 && now != before;
        });
    }
    /// From the briefing into the running exercise, also where a tap that opened the briefing late has gone
    /// on from there.
    bool start() {
        display.move_mouse(200, 200);
        return comes("the running exercise", [&] {
            if (display.find("ready")) display.tap("Return");
            return wait_until([&] { return display.find("running"); }, 3);
        });
    }
    /// Ends the exercise, and says that it is meant.
    bool finish() {
        display.tap("End");
        return reaches("asks") && tap_out_of("asks", "Return") && reaches("ended");
    }
    /// Keeps a picture for whoever wants to look, and returns it.
    render::ColourImage picture(const std::string& name) {
        const render::ColourImage image = display.screenshot();
        std::filesystem::create_directories(SELDINGER_SCREENSHOTS);
        const auto bytes = render::encode_png(image);
        write(std::filesystem::path(SELDINGER_SCREENSHOTS) / (name + ".png"),
              std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
        return image;
    }
    /// A picture of what a key opens; the key closes it again.
    void picture_behind(const char* key, double seconds, const std::string& name) {
        display.tap(key);
        sleep_for(seconds);
        picture(name);
        display.tap(key);
    }
    Outcome close() {
        display.close();
        const Outcome outcome = program->wait();
        program.reset();
        return outcome;
    }

    TemporaryFolder folder;
    VirtualDisplay display;
    std::optional<Started> program;
};

inline Outcome replay(const Room& room, const std::string& scenario) {
    const std::string recording = room.folder / "run.gw";
    return run(room.folder,
               {"run", scenario, "--commands", recording, "--expect", recording, "--out", room.folder / "out",
                "--frames", "none", "--cache", std::string(SELDINGER_SOURCE) + "/build/cache"});
}

/// What a recording says so far, also while it is written.
inline script::CommandScript so_far(const std::filesystem::path& recording) {
    const std::string text = read(recording);
    return script::parse_commands(text.substr(0, text.rfind('\n') + 1), recording.string());
}

}  // namespace test

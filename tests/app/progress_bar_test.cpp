#include "app/progress_bar.h"

#include <gtest/gtest.h>

#include "tests/engine/fixtures.h"

namespace app {
namespace {

using std::chrono::seconds;

/// A bar whose clock stands still unless moved, and what it wrote.
class Watched {
public:
    explicit Watched(bool terminal)
        : out_(std::fopen((folder_ / "out.txt").c_str(), "w")),
          bar_(std::make_unique<ProgressBar>(out_, terminal, seconds(5), [this] { return now_; })) {}
    ~Watched() {
        bar_.reset();
        std::fclose(out_);
    }
    void show_at(int second, double part, const std::string& doing) {
        now_ = ProgressBar::Clock::time_point(seconds(second));
        bar_->show(part, doing);
    }
    std::string written() const { return test::read(folder_ / "out.txt"); }
    std::string ended() {
        bar_.reset();
        std::fflush(out_);
        return written();
    }

private:
    test::TemporaryFolder folder_;
    ProgressBar::Clock::time_point now_{};
    std::FILE* out_;
    std::unique_ptr<ProgressBar> bar_;
};

}  // namespace

TEST(ProgressBar, WritesALineEveryFewSecondsWhereThereIsNoTerminal) {
    Watched watched(false);
    watched.show_at(0, 0.0, "vessels");
    watched.show_at(4, 0.3, "vessels");
    EXPECT_EQ(watched.written(), "");
    watched.show_at(5, 0.4, "vessels");
    EXPECT_EQ(watched.written(), "vessels: 40 %\n");  // at once, not when the program ends
    watched.show_at(9, 0.9, "vessels");
    watched.show_at(12, 0.6, "distance field");
    watched.show_at(13, 0.7, "distance field");
    EXPECT_EQ(watched.ended(), "vessels: 40 %\ndistance field: 60 %\n");
}

TEST(ProgressBar, WritesNothingOfWorkThatIsDoneSoonWhereThereIsNoTerminal) {
    Watched watched(false);
    for (int k = 0; k <= 4; ++k) watched.show_at(k, 0.25 * k, "frames");
    watched.show_at(20, 1.0, "frames");  // done
    EXPECT_EQ(watched.ended(), "");
}

TEST(ProgressBar, DrawsAtOnceOnATerminalAndLeavesAnEmptyLine) {
    Watched watched(true);
    watched.show_at(0, 0.5, "frames");
    test::expect_said(watched.written(), "[###############...............] frames");
    const std::string all = watched.ended();
    EXPECT_EQ(all.substr(all.size() - 4), "\r\033[K");
    EXPECT_EQ(all.find('\n'), std::string::npos);
}

}  // namespace app

#include "engine/run/output_folder.h"

#include <utility>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/outputs.h"
#include "engine/run/angiogram_folder.h"
#include "engine/run/frame_sink.h"
#include "engine/run/picture_file.h"
#include "engine/run/truth_files.h"

namespace run {
namespace {

namespace fs = std::filesystem;

constexpr const char* own_files[] = {"run.gw", "score.json", "sheet.png"};
constexpr const char* frame_folders[] = {"frames", "panel", "truth", "dicom"};

/// Whether the file is an angiogram or named frame_000123 with one of the endings that are written here.
bool is_of_a_frame(const fs::path& file) {
    const std::string name = file.filename().string(), stem = name.substr(0, frame_file_name(0).size() - 4);
    const std::string ending = name.substr(stem.size());
    if (is_angiogram_file_name(name)) return true;
    return frame_of_file_name(stem + ".png") >= 0 && (ending == ".png" || is_truth_ending(ending));
}

void take_out(const fs::path& file) {
    std::error_code error;
    fs::remove(file, error);
    if (error) throw io::InputError("{}: cannot be replaced: {}", file.string(), error.message());
}

}  // namespace

void refuse_to_overwrite(const fs::path& out, const fs::path& script,
                         const std::optional<fs::path>& expected) {
    if (io::same_file(out / "run.gw", script)) {
        throw io::InputError("{}: the run would overwrite its own commands; expected another output folder",
                             script.string());
    }
    if (expected && (io::same_file(out, *expected) || io::same_file(out / "run.gw", *expected))) {
        throw io::InputError(
            "{}: the run would overwrite what it is compared with; expected another output folder",
            expected->string());
    }
}

void refuse_to_replace(std::span<const fs::path> inputs, const fs::path& out, const fs::path& trace) {
    std::vector<io::Output> outputs;
    for (const char* name : own_files) outputs.push_back({"--out", out / name});
    if (!trace.empty()) outputs.push_back({"--trace", trace});
    io::require_distinct(outputs, inputs);
    for (const char* part : frame_folders) {
        const auto is_within = [&](const fs::path& file) {
            return io::same_file(file.parent_path().empty() ? "." : file.parent_path(), out / part) &&
                   is_of_a_frame(file);
        };
        if (!trace.empty() && is_within(trace))
            throw io::InputError("--trace: {} is a file of the run's own; expected another file",
                                 trace.string());
        for (const fs::path& input : inputs)
            if (is_within(input) || io::same_file(input, out / part))
                throw io::InputError(
                    "--out: {} would be removed, and is read; expected another output folder",
                    input.string());
    }
}

OutputFolder::OutputFolder(fs::path path, Parts parts) : own_(path) {
    for (const char* name : own_files)
        if (std::error_code none; fs::is_directory(path / name, none))
            throw io::InputError("{}: cannot be written: a folder is in its place", (path / name).string());
    const std::pair<bool, const char*> wanted[] = {
        {parts.frames, "frames"}, {parts.panel, "panel"}, {parts.truth, "truth"}, {parts.dicom, "dicom"}};
    for (const auto& [asked, name] : wanted)
        if (asked) own_.make(name);
}

void OutputFolder::take_out_earlier_run() const {
    for (const char* name : own_files) take_out(own_.path() / name);
    io::remove_leftovers(own_.path());
    for (const fs::path& folder : {frames(), panel(), truth(), dicom()}) {
        std::vector<fs::path> old;
        std::error_code error;
        for (const auto& entry : fs::directory_iterator(folder, error))
            if (is_of_a_frame(entry.path())) old.push_back(entry.path());
        for (const fs::path& file : old) take_out(file);
        io::remove_leftovers(folder);
    }
}

void OutputFolder::write_score(const std::string& json) const {
    io::write_whole(own_.path() / "score.json", json);
}

void OutputFolder::write_sheet(const render::GrayImage& page) const {
    write_picture(own_.path() / "sheet.png", page);
}

}  // namespace run

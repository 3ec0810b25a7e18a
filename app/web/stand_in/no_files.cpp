/// What a run writes for other programs, which a page does not: panels, ground truth, DICOM objects, markups
/// of 3D Slicer.

#include "engine/io/error.h"
#include "engine/run/output_folder.h"
#include "engine/run/slicer_markups.h"
#include "engine/run/truth_files.h"
#include "render/panel/contact_sheet.h"
#include "render/panel/panel.h"

namespace {

[[noreturn]] void refuse(const char* what) {
    throw io::InputError("a page makes no {}; expected the program to be asked for them", what);
}

}  // namespace

namespace render {

struct Panel::State {};
std::filesystem::path font_folder() {
    return {};
}
Panel::Panel(PanelSpec) {
    refuse("panels");
}
Panel& Panel::operator=(Panel&&) noexcept = default;
Panel::~Panel() = default;
ColourImage Panel::draw(const GrayImage&, const GrayImage*, const Readout&) {
    refuse("panels");
}
PanelArea Panel::live_area(int, int) const {
    return {};
}
GrayImage contact_sheet(std::span<const GrayImage>, int, int, std::span<const std::string>) {
    refuse("contact sheets");
}

}  // namespace render

namespace dicom {

struct Angiogram::Content {};
Angiogram::Angiogram(Series) {
    refuse("DICOM objects");
}
Angiogram::~Angiogram() = default;
void Angiogram::add(const render::GrayImage&, const render::Technique&, double) {}
void Angiogram::add(const render::Field&, const render::Technique&, double) {}
void Angiogram::inject(std::optional<double>) {}
const Series& Angiogram::series() const {
    refuse("DICOM objects");
}
int Angiogram::frames() const {
    return 0;
}
bool Angiogram::is_full() const {
    return false;
}
void Angiogram::write(const std::filesystem::path&) const {}

}  // namespace dicom

namespace run {

bool is_markup_name(const std::string&) {
    return false;
}
void SlicerMarkups::take(const exercise::Frame&) {
    refuse("markups of 3D Slicer");
}
void SlicerMarkups::finish() const {}
bool is_truth_ending(const std::string&) {
    return false;
}
TruthFolder::TruthFolder(std::filesystem::path, const exercise::TruthParts&) {
    refuse("ground truth");
}
void TruthFolder::take(exercise::Exercise&, const exercise::FrameTime&) {}
void TruthFolder::hurry() {}
void TruthFolder::finish() {}

}  // namespace run

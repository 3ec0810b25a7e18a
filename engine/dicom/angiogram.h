#pragma once
/// X-Ray Angiographic Image objects (DICOM PS3.3, A.14): what an angiography system archives of an
/// acquisition.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "render/picture/image.h"
#include "render/xray/c_arm.h"
#include "render/xray/x_ray_tube.h"

namespace dicom {

/// Study Date of every object (DA). A DICOMDIR needs one (PS3.3, F.5-2), and a run has none.
inline constexpr const char* placeholder_date = "20000101";

enum class Radiation { Fluoroscopy, Acquisition };  // Radiation Setting SC, GR

enum class Pixels {
    Shown,  // 8 bits, as on the monitor: Pixel Intensity Relationship DISP
    Signal  // 16 bits, proportional to the detector's signal: LIN
};

/// Whose examination it is said to be, and when. By default nobody's: a name made of the scenario's, and the
/// placeholder.
struct Identity {
    std::string date = placeholder_date, time = "000000";  // DA, TM
    std::string name, id;  // PN of up to five components, LO; empty = simulated

    bool is_dated() const { return date != placeholder_date; }
};

/// "2026-11-27" or "20261127", also with "T14:05:00" or "T140500". Throws InputError, which names the option.
void read_date(const std::string&, Identity&);
/// "Doe^Jane" or "Doe^Jane,4711", the name as DICOM has it, then the patient's ID. Throws InputError, which
/// names the option.
void read_patient(const std::string&, Identity&);

/// What all frames of an object share. Equal series with equal frames give equal files: unique identifiers
/// are made of the content, and dates, which archives need, are those of the identity.
struct Series {
    Identity identity;
    std::string program;           // name and version
    std::string patient, subject;  // names: of the scenario, of who was trained (may be empty)
    std::uint64_t study = 0;       // identifies the run that the object belongs to
    int number = 1;                // of the series in the study, from 1
    std::string description;
    render::CArm arm;
    Radiation radiation = Radiation::Fluoroscopy;
    Pixels pixels = Pixels::Shown;
    std::string derivation;      // how shown images were made of more than their own pulse; empty = not so
    bool first_is_mask = false;  // signals of DSA: subtract the first frame from the others
    double frame_rate = 0;       // wanted [1/s]; 0 = not known
    double scale = 1;            // of Signal: stored value per quantum of a pixel and nGy
};

/// Collects the frames of one pose and writes the object.
class Angiogram {
public:
    /// Throws InputError for an arm that has no picture.
    explicit Angiogram(Series);
    ~Angiogram();

    /// A frame at `seconds` of the run, later than the last. Throws std::invalid_argument for an image of
    /// another size or of other pixels than the series.
    void add(const render::GrayImage&, const render::Technique&, double seconds);
    /// Quanta of each pixel per nGy of detector dose; what exceeds 65535 after scaling is cut off, NaN is 0.
    void add(const render::Field& signal, const render::Technique&, double seconds);
    /// Marks the contrast agent, with its own iodine, not that of the blood that it mixes with [mg/ml], where
    /// that is known.
    void inject(std::optional<double> iodine);

    const Series& series() const;
    int frames() const;
    /// Whether another frame would exceed the 256 MiB of pixels, or the 3600 frames, that an object may have
    /// here.
    bool is_full() const;

    /// Writes the file, complete or not at all. Throws InputError where that fails, and std::logic_error
    /// without a frame.
    void write(const std::filesystem::path&) const;

private:
    struct Content;
    std::unique_ptr<Content> content_;
};

/// The image's row and column directions in the patient, such as "L\F" or "LP\FA" (Patient Orientation).
std::string patient_orientation(const render::CArm&);

}  // namespace dicom

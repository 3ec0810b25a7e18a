#include "engine/studies/hands_published.h"

#include <stdexcept>
#include <string>

namespace studies {
namespace {

constexpr double none = PublishedSize::none;

// Searched for in 2026: abstracts, open papers and makers' pages.
const PublishedSize sizes[] = {
    {"whip", "jump of the tip's direction while the hub turns slowly", "deg", 10, 90,
     "bench: wires of 0.34 mm that are not well straightened, three turns of one end", true,
     "Advanced Materials & Processes, October 2019, p. 49: \"tens of degrees in lag-snap or whip\", taken as "
     "10 to 90; no numbers in vessels were found",
     SourceMark::Read},
    {"wind-up", "hysteresis: hub's angle, turned right less turned left, at the same angle of the tip", "deg",
     10, 90, "bench: the same wires", true, "the same: \"lag\"", SourceMark::Read},
    {"stick-slip", "push that breaks away after a rest over the push that slides", "1", 1.1, 2.0,
     "rigid-wall finite elements of wires and catheters: ratios of their coefficients 0.10/0.09, 0.2/0.1, "
     "0.04/0.02",
     true,
     "as Irsim's notes quote them. The catalogue's static coefficients are 1.25 to 1.5 times the kinetic "
     "ones, so that this holds what the hub feels of it and no more",
     SourceMark::SecondHand},
    {"prolapse", "way of the tip back out of its branch while the wire is pushed past it", "mm", 6, 30,
     "models of the middle cerebral and internal carotid arteries, wires of 0.014 in pushed too far", false,
     "Synchro Select study (PMC12213524), as Irsim's notes quote it; of the bifurcation of the aorta there "
     "is no number",
     SourceMark::SecondHand},
    {"buckling", "push at which the shaft outside bows", "N", 0.8, 1.8,
     "pushes on wires of 0.035 in, working wires to support wires", true,
     "Sarkissian et al. 2011 (Urology), as Irsim's notes quote it. The free length of Euler's formula was "
     "chosen once so that it is within a third of these for the catalogue's wires",
     SourceMark::SecondHand},
    {"kick-back", "way of the catheter's tip back while the wire in it is pushed on", "mm", 6, 30,
     "models of the middle cerebral and internal carotid arteries, pushed too far", true,
     "Synchro Select study (PMC12213524), as Irsim's notes quote it", SourceMark::SecondHand},
    {"deep seating", "way of a catheter of 5F past the ostium before its shaft bows", "mm", 0, 106,
     "guide extensions of 5F through guides of 6F in coronary arteries of 65 patients: 33 mm in the mean, up "
     "to 106 mm",
     true, "de Man et al. 2012, as Fraser and Mamas (EuroIntervention 2012;8:307) give it in their comment",
     SourceMark::Read},
    {"drag", "way of a wire that no hand holds over the way of the catheter on it", "1", none, none, "",
     false, "", SourceMark::None},
    {"release", "way of the hub back before the tip follows", "mm", none, none, "", false, "",
     SourceMark::None},
    {"Simmons", "leg: height of the tip above the knee, in the ascending aorta", "mm", none, none, "", false,
     "", SourceMark::None},
    {"root loop", "width of the wire's loop, 15 mm behind its turn", "mm", 17, 40,
     "the root's own width in adults: 29 mm at the sinotubular junction, 34 mm at the sinuses, with spreads "
     "of 3 to 4 mm; 21.8 (sd 2.4) mm in 30 cadavers",
     true,
     "Roman 1989 (Am J Cardiol 64:507), by which the anatomy's root was drawn: this holds the anatomy more "
     "than the wire. Lower end: cadavers, read.qxmd.com/read/30772639 (abstract), mean less two sd; upper "
     "end: sinuses, mean and nearly two sd. Of loops themselves no number was found",
     SourceMark::SecondHand},
    {"straightening", "farthest that the wire moves a vessel", "mm", 2, 20,
     "iliac arteries and visceral ostia in repairs of aortic aneurysms, stiff wires and delivery systems",
     true,
     "Maurel et al. 2014 (J Endovasc Ther), Lalys et al. 2019 (JVIR 30:1386), Emendi et al. 2023 (Front "
     "Physiol): means of 3 to 8, largest of some 20 mm",
     SourceMark::Memory},
    {"wedge", "push that the last 5 mm at the hub add", "N", 0.0154, 0.0556,
     "bench: microwires pushed through analogues of clots, largest force at the proximal end, medians of "
     "soft and of hard ones: an obstacle that yields, as a branch too narrow does not",
     false,
     "\"Can micro-guidewire advancement forces predict clot consistency and location\" (abstract, "
     "infoscience.epfl.ch/entities/publication/fdd98be3-559e-4217-940b-ef16dcb88432)",
     SourceMark::Read},
};

constexpr std::string_view tortuous =
    "Zoarski et al., AJNR 1998;19:1571 (abstract): a tube of 1.65 mm as the intracranial carotid, 20 cm long";
const PublishedPush pushes[] = {
    {"cerebral", 0, 0.078, "a steel wire of 0.014 in alone: largest load below 8 g", tortuous,
     SourceMark::Read},
    {"cerebral_micro", 0.088, 0.137, "reinforced microcatheters over it: largest load 9 to 14 g", tortuous,
     SourceMark::Read},
};

}  // namespace

std::string_view name_of(SourceMark mark) {
    switch (mark) {
        case SourceMark::Read:
            return "read";
        case SourceMark::SecondHand:
            return "second-hand";
        case SourceMark::Memory:
            return "from memory, not checked";
        case SourceMark::None:
            break;
    }
    return "none found";
}

std::span<const PublishedSize> published_sizes() {
    return sizes;
}

const PublishedSize& published_size(std::string_view behaviour) {
    for (const PublishedSize& size : sizes)
        if (size.behaviour == behaviour) return size;
    throw std::out_of_range("no behaviour " + std::string(behaviour));
}

std::span<const PublishedPush> published_pushes() {
    return pushes;
}

}  // namespace studies

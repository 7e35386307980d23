//! A panel: an SVG element with a title and a description, whose colours are the page's CSS variables.

use anyhow::Context as _;
use maud::{Markup, PreEscaped, html};
use plotters::coord::Shift;
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;

/// plotters rounds coordinates to whole units: a panel is drawn this many times larger than it is shown.
pub(super) const UNITS_PER_PIXEL: i32 = 4;

/// Size of ordinary text, in pixels.
const TEXT_PIXELS: f64 = 11.5;

pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(super) type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// A role in a plot; which colour that is, in light and in dark, the style sheet says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Ink {
    Text,
    Muted,
    Grid,
    Shade,
    Desired,
    Baseline,
    Comparison,
    Ridge,
    Network,
    BothLanes,
    Learned,
    Paper,
}

impl Ink {
    const ALL: [(Self, &'static str); 12] = [
        (Self::Text, "text"),
        (Self::Muted, "muted"),
        (Self::Grid, "grid"),
        (Self::Shade, "shade"),
        (Self::Desired, "desired"),
        (Self::Baseline, "baseline"),
        (Self::Comparison, "comparison"),
        (Self::Ridge, "ridge"),
        (Self::Network, "network"),
        (Self::BothLanes, "both-lanes"),
        (Self::Learned, "learned"),
        (Self::Paper, "paper"),
    ];

    /// The stand-in which plotters draws with, and which [`panel`] replaces by a CSS variable.
    pub(super) const fn colour(self) -> RGBColor {
        RGBColor(1, 2, self as u8)
    }

    pub(super) fn line(self, pixels: f64) -> ShapeStyle {
        ShapeStyle { color: self.colour().to_rgba(), filled: false, stroke_width: units(pixels).unsigned_abs() }
    }

    pub(super) fn fill(self) -> ShapeStyle {
        self.colour().filled()
    }

    /// Text style with the anchor's position.
    pub(super) fn text(self, horizontal: HPos, vertical: VPos) -> TextStyle<'static> {
        // plotters divides the size by 1.24 on the way to SVG.
        let size = TEXT_PIXELS * f64::from(UNITS_PER_PIXEL) * 1.24;
        let mut style: TextStyle<'static> = ("sans-serif", size).into();
        style.color = self.colour().to_backend_color();
        style.pos = Pos::new(horizontal, vertical);
        style
    }
}

pub(super) use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Pixels in units of the drawing.
pub(super) fn units(pixels: f64) -> i32 {
    (pixels * f64::from(UNITS_PER_PIXEL)).round() as i32
}

/// Draws one panel of `width` x `height` pixels.
pub(super) fn panel(
    (width, height): (u32, u32),
    title: &str,
    description: &str,
    paint: impl for<'a> FnOnce(&Area<'a>) -> Drawn,
) -> anyhow::Result<Markup> {
    let scale = UNITS_PER_PIXEL.unsigned_abs();
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (width * scale, height * scale)).into_drawing_area();
        paint(&area).and_then(|()| area.present()).with_context(|| format!("the plot '{title}' cannot be drawn"))?;
    }
    for (ink, variable) in Ink::ALL {
        let RGBColor(red, green, blue) = ink.colour();
        svg = svg.replace(&format!("\"#{red:02X}{green:02X}{blue:02X}\""), &format!("\"var(--{variable})\""));
    }
    let svg = svg.replace(" opacity=\"1\"", "").replace(" font-family=\"sans-serif\"", "");
    let body = svg.split_once('>').map_or("", |(_, rest)| rest).trim_end().trim_end_matches("</svg>");
    Ok(html! {
        svg viewBox=(format!("0 0 {} {}", width * scale, height * scale)) style=(format!("max-width:{width}px"))
            role="img" xmlns="http://www.w3.org/2000/svg" {
            title { (title) }
            desc { (description) }
            (PreEscaped(body))
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn titles_are_escaped_and_colours_are_the_pages() {
        let drawn = panel((40, 20), "<b>&", "d", |area| {
            area.draw(&PathElement::new(vec![(0, 0), (9, 9)], Ink::Baseline.line(1.5)))?;
            area.draw(&Text::new("<i>", (3, 3), Ink::Text.text(HPos::Left, VPos::Center)))
        })
        .unwrap()
        .into_string();
        assert!(drawn.contains("&lt;b&gt;&amp;") && drawn.contains("&lt;i&gt;"), "{drawn}");
        assert!(drawn.contains("stroke=\"var(--baseline)\"") && !drawn.contains("\"#"), "{drawn}");
        roxmltree::Document::parse(&drawn).unwrap();
    }
}

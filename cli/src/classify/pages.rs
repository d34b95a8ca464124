//! The overlays of `lobes classify`, and its page.

use super::light_page;
use super::words::{LEVEL, NO_SINGLE_FINISH, finishes, names, sentence};
use super::{Entry, Read};
use crate::arguments::Classify;
use crate::ball_light::LightMaps;
use crate::error::Result;
use crate::output::OutputFolder;
use crate::report::{Figure, Image, Inline, Page, posterior_map};
use crate::{console, input};
use lobes::picture::{Circle, Sphere};
use lobes::reflectance::{Finish, Material};

/// The overlays, and the page where it is asked for.
pub(super) struct Pages<'a> {
    options: &'a Classify,
    /// Opened when there is something to write.
    output: Option<OutputFolder>,
    page: Page,
    /// A line for each picture, with the class of its row.
    summary: Vec<(&'static str, Vec<String>)>,
}

impl<'a> Pages<'a> {
    pub(super) fn new(options: &'a Classify) -> Result<Self> {
        let mut pages = Self {
            options,
            output: None,
            page: Page::new(
                "Finishes read off pictures",
                &[
                    Inline::Text(
                        "For each picture the ball that was read, the probability of each finish and, where they were asked for, of each name, and the \
                         roughness σ and the specular share ρ_s / (ρ_s + ρ_d), with the interval that holds 90 % of each. A learned model, which ",
                    ),
                    Inline::Code("docs/explanation/photographs.md"),
                    Inline::Text(" in the repository explains."),
                ],
            ),
            summary: Vec::new(),
        };
        if options.report {
            pages.output()?;
        }
        Ok(pages)
    }

    fn output(&mut self) -> Result<&mut OutputFolder> {
        match &mut self.output {
            Some(output) => Ok(output),
            none => Ok(none.insert(OutputFolder::open(&self.options.out)?)),
        }
    }

    /// What is shown of a picture, and of the light about its ball where that was read.
    pub(super) fn add(
        &mut self,
        entry: &Entry,
        read: &Read,
        materials: &[Material],
        light: Option<&LightMaps>,
    ) -> Result<()> {
        let file = if input::is_standard(entry.path) {
            input::NAME.into()
        } else {
            entry.path.file_name().unwrap_or_default().to_string_lossy()
        };
        let name = entry.named(&file);
        let (ball, answer) = match read {
            Ok(read) => read,
            Err(error) => {
                if self.options.report {
                    self.page.heading(&name);
                    self.page.paragraph(&error.to_string());
                    let cells = [name.as_str(), "not classified", "–", "–", "–"];
                    self.summary
                        .push(("quoted", cells.map(str::to_owned).to_vec()));
                }
                return Ok(());
            }
        };
        let stem = format!("{:04}-{}", entry.number, crate::slug(&name));
        let Circle { x, y, radius } = ball.circle;
        let mut pictures = Vec::new();
        if let Some((overlay, size)) = &ball.overlay {
            let path = format!("{stem}-found.png");
            self.output()?.add(path.clone(), overlay)?;
            pictures.push(Figure {
                images: vec![Image {
                    path,
                    seen: format!(
                        "The picture {name} with a magenta circle about {x:.0}, {y:.0} of radius {radius:.0} pixels"
                    ),
                    size: *size,
                }],
                caption: vec!["Where the ball was found".into()],
            });
        }
        let finish = &answer.finish;
        let said = finish.finish().map_or(NO_SINGLE_FINISH, Finish::name);
        if let Some(picture) = &ball.picture {
            let path = format!("{stem}.png");
            self.output()?.add(path.clone(), picture)?;
            pictures.push(Figure {
                images: vec![Image {
                    path,
                    seen: format!("The ball of {name} by itself, called {said}"),
                    size: (Sphere::SIZE, Sphere::SIZE),
                }],
                caption: vec!["The ball as it was read".into()],
            });
        }
        if let Some(mask) = &ball.mask {
            let path = format!("{stem}-seen.png");
            self.output()?.add(path.clone(), mask)?;
            pictures.push(Figure {
                images: vec![Image {
                    path,
                    seen: format!("The ball of {name} in grey, with what is not its body's shading in colours"),
                    size: (Sphere::SIZE, Sphere::SIZE),
                }],
                caption: vec![
                    format!("Usable: {:.0} %", 100.0 * ball.seen_where.usable()),
                    "red is a print, a hole or something before the ball, blue a reflection, yellow burnt out".into(),
                ],
            });
        }
        if !self.options.report {
            return Ok(());
        }
        self.page.heading(&name);
        self.page
            .paragraph(&sentence(ball, answer, materials, entry.of > 1));
        if let Some(light) = light {
            pictures.extend(light_page::ball_again(light, ball.exposure)?);
        }
        self.page.grid(220, &pictures);
        if let Some(light) = light {
            light_page::show(&mut self.page, light, finish)?;
        }
        let ranked = finishes(finish);
        let mut rows: Vec<(f64, &str)> = ranked.clone();
        if let Some(verdict) = &answer.name {
            let path = format!("{stem}-posterior.svg");
            let map = posterior_map(&verdict.posterior);
            self.output()?.add(path.clone(), &map)?;
            let (share, sigma) = verdict.posterior.mode();
            self.page.drawing(
                &map,
                &format!(
                    "A map of the posterior, darkest at a specular share of {share:.2} and σ {sigma:.3}"
                ),
                &[
                    Inline::Text("The posterior of what plain spheres taught, beside the names: the darker the likelier, with a cross at its mode. "),
                    Inline::Link("As a file", &path),
                ],
            );
            rows.extend(names(verdict, materials));
        }
        let cells = |[low, middle, high]: [f64; 3], decimals: usize| {
            format!("{middle:.decimals$} ({low:.decimals$} – {high:.decimals$})")
        };
        let (p, likeliest) = ranked[0];
        let sigma = match finish.sigma.below() {
            Some(end) => format!("below {end}"),
            None => cells(finish.sigma.interval(LEVEL), 3),
        };
        self.summary.push((
            "",
            vec![
                name.to_string(),
                likeliest.to_owned(),
                format!("{p:.3}"),
                sigma,
                cells(finish.share.interval(LEVEL), 2),
            ],
        ));
        let rows: Vec<(&str, Vec<String>)> = rows
            .into_iter()
            .map(|(p, name)| ("", vec![name.to_owned(), format!("{p:.3}")]))
            .collect();
        self.page.table(
            "How likely each finish is, and each name that was asked for",
            &["answer", "probability#"],
            &rows,
        );
        Ok(())
    }

    pub(super) fn finish(mut self, summary: &str) -> Result<()> {
        let Some(mut output) = self.output.take() else {
            return Ok(());
        };
        let out = &self.options.out;
        if self.options.report {
            if self.summary.len() > 1 {
                let headings = [
                    "picture",
                    "likeliest",
                    "probability#",
                    "σ, 90 % interval#",
                    "specular share, 90 % interval#",
                ];
                self.page.lead(&[Inline::Text(summary)]);
                self.page.summary("All pictures", &headings, &self.summary);
            }
            let version = format!("lobes {}", env!("CARGO_PKG_VERSION"));
            output.add("index.html", self.page.html(&[Inline::Text(&version)]))?;
        }
        output.commit()?;
        if self.options.report {
            console::note(format!("wrote {}", out.join("index.html").display()));
        } else {
            console::note(format!("wrote where balls were found to {}", out.display()));
        }
        Ok(())
    }
}

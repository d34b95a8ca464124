//! One page of HTML that opens from disk and asks the network for nothing.

use std::fmt::Write;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use crate::report::plot::escape;

/// A picture in a file beside the page, which opens by itself when it is clicked, or in the page
/// itself.
#[derive(Debug, Clone)]
pub struct Image {
    /// The path, relative to the page; or the picture itself, as [`Image::inside`] writes it.
    pub path: String,
    /// What is seen in it, for those who do not see it.
    pub seen: String,
    /// Its width and height in pixels.
    pub size: (usize, usize),
}

impl Image {
    /// A PNG that is part of the page.
    pub fn inside(png: &[u8], seen: String, size: (usize, usize)) -> Self {
        Self {
            path: format!("data:image/png;base64,{}", BASE64_STANDARD.encode(png)),
            seen,
            size,
        }
    }
}

/// One picture, or some side by side, and what stands under them.
#[derive(Debug, Clone)]
pub struct Figure {
    /// The pictures.
    pub images: Vec<Image>,
    /// What stands under them; the first line is their name.
    pub caption: Vec<String>,
}

/// A piece of a paragraph.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum Inline<'a> {
    /// Text.
    Text(&'a str),
    /// Text that is typed as it stands: a command, a file, an option.
    Code(&'a str),
    /// (text, address): a link, followed only when it is clicked.
    Link(&'a str, &'a str),
}

impl Inline<'_> {
    fn html(&self) -> String {
        match self {
            Self::Text(text) => escape(text),
            Self::Code(text) => format!("<code>{}</code>", escape(text)),
            Self::Link(text, to) => format!("<a href=\"{}\">{}</a>", escape(to), escape(text)),
        }
    }
}

/// A page under construction. Text is escaped.
#[derive(Debug, Clone)]
pub struct Page {
    title: String,
    lead: String,
    body: String,
    /// The headings, each with the name that the list of contents links to.
    contents: Vec<(String, String)>,
}

/// Colours by name, for light and for dark; text, tables and figures; narrow windows; paper.
const STYLE: &str = "\
:root{color-scheme:light dark;--ink:#1f2328;--soft:#57606a;--ground:#fff;--raised:#f6f8fa;--line:#d5dae0;--link:#0a5cad;--mark:#e8f1fb;--tile:#d3d8dd;\
--good:#0b6b4f;--bad:#a8420a}\
@media(prefers-color-scheme:dark){:root{--ink:#e6e8eb;--soft:#a3abb5;--ground:#14171a;--raised:#1d2125;--line:#3a4149;--link:#7ab8f5;\
--mark:#1b3048;--tile:#4b525a;--good:#4fc79f;--bad:#f0935a}}\
*{box-sizing:border-box}\
body{font:16px/1.55 system-ui,-apple-system,'Segoe UI',sans-serif;color:var(--ink);background:var(--ground);margin:0;overflow-wrap:anywhere}\
main,header,footer,nav{max-width:980px;margin:0 auto;padding:0 20px}\
header{padding-top:36px}h1{font-size:30px;line-height:1.2;margin:0 0 12px;text-wrap:balance}\
h2{font-size:21px;line-height:1.3;margin:52px 0 8px;padding-top:14px;border-top:1px solid var(--line)}h3{font-size:16px;margin:28px 0 4px}\
p,dl{margin:10px 0;max-width:74ch}header p:first-of-type{font-size:18px}a{color:var(--link)}\
code{font:0.9em ui-monospace,SFMono-Regular,Menlo,Consolas,monospace;background:var(--raised);border-radius:4px;padding:1px 4px}\
nav ol{columns:2;column-gap:32px;padding-left:22px;margin:10px 0}nav li{break-inside:avoid}\
.skip{position:absolute;left:-999px}.skip:focus{left:8px;top:8px;background:var(--ground);padding:6px 10px}\
dt{font-weight:600;margin-top:10px}dd{margin:0 0 0 1.2em}\
figure{margin:18px 0}figcaption{font-size:13.5px;line-height:1.45;color:var(--soft);margin-top:6px}figcaption b{color:var(--ink);font-weight:600;display:block}\
.drawing svg{display:block;max-width:100%;height:auto;color:var(--ink)}.drawing .ground{fill:none}.drawing .halo{stroke:var(--ground)}.drawing .rule{stroke:var(--line)}\
.drawing .line:hover polyline{stroke:var(--bad);stroke-width:3;stroke-opacity:1}\
.grid{display:grid;gap:22px 18px;margin:18px 0;grid-template-columns:repeat(auto-fill,minmax(min(100%,max(var(--least),22%)),1fr))}.grid figure{margin:0;min-width:0}\
.images{display:flex;gap:6px}.images a{flex:1;min-width:0;display:block;border-radius:6px}.images img{width:100%;height:auto;display:block;border-radius:6px;background:var(--tile)}\
.images .round{padding:3%}.images a:hover,.images a:focus-visible{outline:2px solid var(--link);outline-offset:2px}\
.scroll{overflow-x:auto}table{border-collapse:collapse;font-size:14px;font-variant-numeric:tabular-nums;overflow-wrap:normal}\
.caption{color:var(--soft);font-size:13.5px;margin:16px 0 0}.stack,.scroll{margin:6px 0 14px}\
th,td{padding:6px 16px 6px 0;text-align:left;vertical-align:top;border-bottom:1px solid var(--line)}th:first-child,td:first-child{padding-left:8px}\
th{font-weight:600;border-bottom-color:var(--soft);vertical-align:bottom}.number{text-align:right;white-space:nowrap}\
tr.strong td{font-weight:600;background:var(--mark)}tr.quoted td{color:var(--soft);font-style:italic}\
tr.good td:last-child{color:var(--good);font-weight:600}tr.bad td:last-child{color:var(--bad);font-weight:600}tr.open td:last-child{color:var(--soft)}.stack td:last-child{white-space:nowrap}\
footer{margin-top:56px;padding-bottom:48px;font-size:13.5px;color:var(--soft)}\
@media(max-width:640px){h1{font-size:25px}nav ol{columns:1}.drawing{overflow-x:auto}.drawing svg{min-width:560px}.drawing.small svg{min-width:0}\
.stack table,.stack tbody,.stack tr,.stack td{display:block}.stack thead{display:none}.stack tr{padding:10px 0;border-bottom:1px solid var(--line)}\
.stack td{border:0;padding:2px 0;text-align:left;white-space:normal}.stack td:first-child{padding-left:0}.stack td::before{content:attr(data-heading) ': ';color:var(--soft);font-weight:400;font-style:normal}}\
@page{size:A4;margin:15mm}\
@media print{:root{color-scheme:light;--ink:#000;--soft:#444;--ground:#fff;--raised:#f6f8fa;--line:#ccc;--link:#000;--mark:#eef4fa;--tile:#d3d8dd;--good:#0b6b4f;--bad:#a8420a}\
body{font-size:11pt}main,header,footer,nav{max-width:none;padding:0}header{padding-top:0}nav,.skip{display:none}h2{margin-top:28px}\
h2,h3,.caption,dt,p:has(+figure),p:has(+.grid),p:has(+dl),p:has(+.caption){break-after:avoid}figure,tr,dt,dd{break-inside:avoid}thead{display:table-header-group}p{orphans:3;widows:3}\
table{font-size:9pt}th,td{padding:4px 10px 4px 0}.scroll,.drawing{overflow:visible}.drawing svg{max-height:225mm;max-width:150mm}.grid{--least:140px!important}tr.strong td{print-color-adjust:exact}\
.images img{print-color-adjust:exact}.images a:hover{outline:0}a{text-decoration:none}}";

impl Page {
    /// A page with a title and a first paragraph.
    pub fn new(title: &str, lead: &[Inline]) -> Self {
        Self {
            title: title.to_owned(),
            lead: paragraph(lead),
            body: String::new(),
            contents: Vec::new(),
        }
    }

    /// Another paragraph above the list of contents.
    pub fn lead(&mut self, text: &[Inline]) {
        self.lead.push_str(&paragraph(text));
    }

    /// A heading, which the list of contents names.
    pub fn heading(&mut self, text: &str) {
        let name = format!("part-{}", self.contents.len() + 1);
        let _ = writeln!(self.body, "<h2 id=\"{name}\">{}</h2>", escape(text));
        self.contents.push((name, text.to_owned()));
    }

    /// A heading under the last.
    pub fn subheading(&mut self, text: &str) {
        let _ = writeln!(self.body, "<h3>{}</h3>", escape(text));
    }

    /// A paragraph.
    pub fn paragraph(&mut self, text: &str) {
        self.rich(&[Inline::Text(text)]);
    }

    /// A paragraph with links and code in it.
    pub fn rich(&mut self, text: &[Inline]) {
        self.body.push_str(&paragraph(text));
    }

    /// Words and what they mean.
    pub fn meanings(&mut self, words: &[(&str, &str)]) {
        self.body.push_str("<dl>\n");
        for (word, meaning) in words {
            let _ = writeln!(
                self.body,
                "<dt>{}</dt><dd>{}</dd>",
                escape(word),
                escape(meaning)
            );
        }
        self.body.push_str("</dl>\n");
    }

    /// Lines to type, and what each does.
    pub fn commands(&mut self, lines: &[(&str, &str)]) {
        self.body.push_str("<dl>\n");
        for (line, what) in lines {
            let _ = writeln!(
                self.body,
                "<dt><code>{}</code></dt><dd>{}</dd>",
                escape(line),
                escape(what)
            );
        }
        self.body.push_str("</dl>\n");
    }

    /// An SVG document as part of the page, where hovering works and the page's colours hold, and
    /// what is seen in it.
    pub fn drawing(&mut self, svg: &str, seen: &str, caption: &[Inline]) {
        let size = if svg.contains("width=\"760\"") {
            ""
        } else {
            " small"
        };
        let _ = writeln!(
            self.body,
            "<figure><div class=\"drawing{size}\">{}</div><figcaption>{}</figcaption></figure>",
            inlined(svg, seen),
            caption.iter().map(Inline::html).collect::<String>()
        );
    }

    /// One figure across the page.
    pub fn figure(&mut self, figure: &Figure) {
        self.body.push_str(&html_of(figure));
    }

    /// Figures side by side, up to four in a row, as many as have `least` pixels of width each.
    pub fn grid(&mut self, least: usize, figures: &[Figure]) {
        let _ = writeln!(
            self.body,
            "<div class=\"grid\" style=\"--least:{least}px\">"
        );
        for figure in figures {
            self.body.push_str(&html_of(figure));
        }
        self.body.push_str("</div>\n");
    }

    /// A table under its caption, which scrolls where the window is too narrow for it. A heading
    /// that ends in `#` marks a column of numbers; a row's class is `""`, `"strong"` or `"quoted"`.
    pub fn table(&mut self, caption: &str, headings: &[&str], rows: &[(&str, Vec<String>)]) {
        self.body
            .push_str(&html_of_table("scroll", caption, headings, rows));
    }

    /// A table of sentences, whose rows become paragraphs where the window is too narrow for it.
    /// What the last cell says is marked by the row's class: `"good"`, `"bad"`, `"open"` or `""`.
    pub fn statements(&mut self, caption: &str, headings: &[&str], rows: &[(&str, Vec<String>)]) {
        self.body
            .push_str(&html_of_table("stack", caption, headings, rows));
    }

    /// A table like that of [`table`](Self::table) above the list of contents, for what the whole
    /// page comes to.
    pub fn summary(&mut self, caption: &str, headings: &[&str], rows: &[(&str, Vec<String>)]) {
        self.lead
            .push_str(&html_of_table("scroll", caption, headings, rows));
    }

    /// The whole document, with what stands at its foot.
    pub fn html(&self, footer: &[Inline]) -> String {
        let mut contents = String::new();
        // Fewer headings than that are seen at a glance.
        if self.contents.len() > 3 {
            contents.push_str("<nav aria-label=\"Contents\"><ol>\n");
            for (name, text) in &self.contents {
                let _ = writeln!(
                    contents,
                    "<li><a href=\"#{name}\">{}</a></li>",
                    escape(text)
                );
            }
            contents.push_str("</ol></nav>\n");
        }
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n\
             <link rel=\"icon\" href=\"data:,\">\n<title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n\
             <a class=\"skip\" href=\"#main\">To the results</a>\n\
             <header><h1>{title}</h1>\n{}</header>\n{contents}<main id=\"main\">\n{}</main>\n<footer>{}</footer>\n</body>\n</html>\n",
            self.lead,
            self.body,
            paragraph(footer),
            title = escape(&self.title),
        )
    }
}

fn html_of_table(
    kind: &str,
    caption: &str,
    headings: &[&str],
    rows: &[(&str, Vec<String>)],
) -> String {
    let class = |i: usize| {
        if headings[i].ends_with('#') {
            " class=\"number\""
        } else {
            ""
        }
    };
    let name = |i: usize| escape(headings[i].trim_end_matches('#'));
    let mut out = format!(
        "<p class=\"caption\">{0}</p><div class=\"{kind}\" tabindex=\"0\" role=\"group\" aria-label=\"{0}\"><table><thead><tr>",
        escape(caption)
    );
    for i in 0..headings.len() {
        let _ = write!(out, "<th scope=\"col\"{}>{}</th>", class(i), name(i));
    }
    out.push_str("</tr></thead><tbody>\n");
    for (row_class, row) in rows {
        let row_class = match *row_class {
            "" => String::new(),
            class => format!(" class=\"{class}\""),
        };
        let _ = write!(out, "<tr{row_class}>");
        for (i, cell) in row.iter().enumerate().take(headings.len()) {
            let heading = if kind == "stack" {
                format!(" data-heading=\"{}\"", name(i))
            } else {
                String::new()
            };
            let _ = write!(out, "<td{}{heading}>{}</td>", class(i), escape(cell));
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody></table></div>\n");
    out
}

fn paragraph(text: &[Inline]) -> String {
    let text: String = text.iter().map(Inline::html).collect();
    format!("<p>{text}</p>\n")
}

/// The document as an element of a page: named by what is seen instead of by its title, which would
/// stand over it as a tooltip.
fn inlined(svg: &str, seen: &str) -> String {
    let named = format!("role=\"img\" aria-label=\"{}\"", escape(seen));
    let mut svg = svg.trim_end().replacen("role=\"img\"", &named, 1);
    if let (Some(start), Some(end)) = (svg.find("<title>"), svg.find("</title>\n")) {
        svg.replace_range(start..end + "</title>\n".len(), "");
    }
    svg
}

fn html_of(figure: &Figure) -> String {
    let mut lines = figure.caption.iter();
    let name = lines.next().map_or("", String::as_str);
    let rest: Vec<String> = lines.map(|line| escape(line)).collect();
    let mut images = String::new();
    for Image { path, seen, size } in &figure.images {
        // Spheres stand off the edges of what is behind them.
        let class = if size.0 == size.1 {
            " class=\"round\""
        } else {
            ""
        };
        if path.starts_with("data:") {
            let _ = write!(
                images,
                "<img{class} src=\"{}\" alt=\"{}\" width=\"{}\" height=\"{}\">",
                escape(path),
                escape(seen),
                size.0,
                size.1
            );
            continue;
        }
        let _ = write!(
            images,
            "<a href=\"{0}\" title=\"{1}\"><img{class} src=\"{0}\" alt=\"{1}\" width=\"{2}\" height=\"{3}\"></a>",
            escape(path),
            escape(seen),
            size.0,
            size.1
        );
    }
    format!(
        "<figure><div class=\"images\">{images}</div><figcaption><b>{}</b>{}</figcaption></figure>\n",
        escape(name),
        rest.join("<br>")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_others_named_is_escaped_everywhere() {
        let evil = "\"><script>alert(1)</script>";
        let mut page = Page::new(evil, &[Inline::Text(evil), Inline::Link(evil, evil)]);
        page.lead(&[Inline::Code(evil)]);
        page.heading(evil);
        page.subheading(evil);
        page.paragraph(evil);
        page.meanings(&[(evil, evil)]);
        page.commands(&[(evil, evil)]);
        page.table(evil, &[evil], &[("", vec![evil.into()])]);
        page.summary(evil, &[evil], &[("quoted", vec![evil.into()])]);
        page.statements(evil, &[evil], &[("good", vec![evil.into()])]);
        let image = Image {
            path: evil.into(),
            seen: evil.into(),
            size: (1, 1),
        };
        page.figure(&Figure {
            images: vec![image],
            caption: vec![evil.into(), evil.into()],
        });
        page.drawing(
            "<svg role=\"img\"><title>t</title>\n</svg>",
            evil,
            &[Inline::Text(evil)],
        );
        let html = page.html(&[Inline::Text(evil)]);
        assert!(
            !html.contains("<script") && !html.contains("\"\">"),
            "{html}"
        );
    }

    #[test]
    fn a_drawing_is_named_by_what_is_seen_and_keeps_its_tooltips() {
        let svg = "<svg role=\"img\">\n<title>Chart</title>\n<g><title>line</title></g></svg>\n";
        assert_eq!(
            inlined(svg, "one line"),
            "<svg role=\"img\" aria-label=\"one line\">\n<g><title>line</title></g></svg>"
        );
    }

    #[test]
    fn every_entry_of_the_contents_leads_to_a_heading() {
        let mut page = Page::new("t", &[]);
        for name in ["a", "b", "c", "d"] {
            page.heading(name);
        }
        let html = page.html(&[]);
        for number in 1..=4 {
            assert!(html.contains(&format!("<h2 id=\"part-{number}\">")));
            assert!(html.contains(&format!("<a href=\"#part-{number}\">")));
        }
    }
}

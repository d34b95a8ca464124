//! One page of HTML that opens from disk and asks the network for nothing.

use std::fmt::Write;

use crate::report::plot::escape;

/// A picture of a page, by its path from the page.
#[derive(Debug, Clone)]
pub struct Figure {
    /// The path, relative to the page.
    pub path: String,
    /// What stands under it; the first line is its name.
    pub caption: Vec<String>,
}

/// A page under construction. Text is escaped.
#[derive(Debug, Clone)]
pub struct Page {
    title: String,
    body: String,
}

const STYLE: &str = "\
:root{color-scheme:light}\
body{font:16px/1.55 system-ui,sans-serif;color:#222;background:#fafafa;margin:0}\
main{max-width:960px;margin:0 auto;padding:32px 20px 64px}\
h1{font-size:28px;line-height:1.2;margin:0 0 8px}h2{font-size:20px;margin:44px 0 8px}\
p{margin:8px 0;max-width:72ch}\
figure{margin:16px 0}figure>img{max-width:100%;height:auto;border:1px solid #e3e3e3;border-radius:6px;background:#fff}\
.grid{display:grid;gap:14px;margin:16px 0}.grid figure{margin:0}\
.grid img{width:100%;border:0;border-radius:4px;display:block;background:none}\
figcaption{font-size:13px;color:#666;margin-top:4px}figcaption b{color:#222;font-weight:600;display:block}\
.scroll{overflow-x:auto}table{border-collapse:collapse;font-size:13.5px;margin:12px 0;font-variant-numeric:tabular-nums}\
th,td{padding:5px 14px 5px 0;text-align:left;border-bottom:1px solid #e3e3e3;white-space:nowrap}\
th{font-weight:600;border-bottom-color:#999}td.number,th.number{text-align:right}\
tr.strong td{font-weight:600;background:#eef4fa}tr.quoted td{color:#666;font-style:italic}\
footer{margin-top:48px;font-size:13px;color:#666}";

impl Page {
    /// A page with a title and a first paragraph.
    pub fn new(title: &str, lead: &str) -> Self {
        let mut page = Self {
            title: title.to_owned(),
            body: String::new(),
        };
        let _ = writeln!(page.body, "<h1>{}</h1>", escape(title));
        page.paragraph(lead);
        page
    }

    /// A heading.
    pub fn heading(&mut self, text: &str) {
        let _ = writeln!(self.body, "<h2>{}</h2>", escape(text));
    }

    /// A paragraph.
    pub fn paragraph(&mut self, text: &str) {
        let _ = writeln!(self.body, "<p>{}</p>", escape(text));
    }

    /// One picture across the page.
    pub fn figure(&mut self, picture: &Figure) {
        self.body.push_str(&figure(picture));
    }

    /// Pictures side by side, `columns` in a row.
    pub fn grid(&mut self, columns: usize, pictures: &[Figure]) {
        let _ = writeln!(
            self.body,
            "<div class=\"grid\" style=\"grid-template-columns:repeat({columns},1fr)\">"
        );
        for picture in pictures {
            self.body.push_str(&figure(picture));
        }
        self.body.push_str("</div>\n");
    }

    /// A table. A heading that ends in `#` marks a column of numbers; a row's class is `""`,
    /// `"strong"` or `"quoted"`.
    pub fn table(&mut self, headings: &[&str], rows: &[(&str, Vec<String>)]) {
        let class = |i: usize| {
            if headings[i].ends_with('#') {
                " class=\"number\""
            } else {
                ""
            }
        };
        self.body
            .push_str("<div class=\"scroll\"><table><thead><tr>");
        for (i, heading) in headings.iter().enumerate() {
            let text = escape(heading.trim_end_matches('#'));
            let _ = write!(self.body, "<th{}>{text}</th>", class(i));
        }
        self.body.push_str("</tr></thead><tbody>\n");
        for (row_class, row) in rows {
            let _ = write!(self.body, "<tr class=\"{row_class}\">");
            for (i, cell) in row.iter().enumerate().take(headings.len()) {
                let _ = write!(self.body, "<td{}>{}</td>", class(i), escape(cell));
            }
            self.body.push_str("</tr>\n");
        }
        self.body.push_str("</tbody></table></div>\n");
    }

    /// The whole document, with what stands at its foot.
    pub fn html(&self, footer: &str) -> String {
        format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
             <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
             <title>{}</title><style>{STYLE}</style></head>\n<body><main>\n{}<footer>{}</footer>\n</main></body></html>\n",
            escape(&self.title),
            self.body,
            escape(footer)
        )
    }
}

fn figure(picture: &Figure) -> String {
    let mut lines = picture.caption.iter();
    let name = lines.next().map_or("", String::as_str);
    let rest: Vec<String> = lines.map(|line| escape(line)).collect();
    format!(
        "<figure><img src=\"{}\" alt=\"{}\"><figcaption><b>{}</b>{}</figcaption></figure>\n",
        escape(&picture.path),
        escape(name),
        escape(name),
        rest.join("<br>")
    )
}

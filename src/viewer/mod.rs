//! Pages that work without a network, drawn by three.js: `report.html`, a run, and the page of `isomorph pick`.
//!
//! | file | what it does |
//! |---|---|
//! | `pick.rs` | [`PickPage`], two shapes side by side to pick pairs of vertices on |
//! | `page.rs` | [`Page`], what the page shows, and [`Page::html`], the page itself |
//! | `block.rs` | positions and values as bytes: what a page's program reads |
//! | `thin.rs` | meshes and clouds with fewer points |
//! | `web/` | the program of both pages and their look: JavaScript, HTML, CSS |
//! | `assets/viewer.js` | the program bundled with three.js: `npm ci` and `node build.mjs` in `web/` |
//!
//! The bundle is committed, so that a build needs no Node. `node build.mjs --check` says whether it is what its
//! sources give. Plain data goes in and text comes out: nothing here reads or writes a file.
//!
//! Positions go in as normalised coordinates. They are rounded to 1/65535 of the box around everything.

mod block;
mod page;
mod pick;
mod thin;

pub(crate) use page::{End, Page, Quality, Track, Values};
pub(crate) use pick::PickPage;
pub(crate) use thin::{Thinned, thinned, thinned_cloud};

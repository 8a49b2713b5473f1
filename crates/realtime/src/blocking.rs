//! The calls to the GPU as programs without an event loop want them: each waits until it is done. A browser has no such
//! calls, since whoever waits there hears of nothing.

use super::{AdapterChoice, Answers, FrameReport, Gpu, GpuError, Optics, Query, Renderer, Scene, Shader, Target, View};
use pollster::block_on;
use sunbeam::methods::{AnswerKind, Method, MethodShader};

impl Gpu {
    /// As [`Gpu::open_async`], and waits for it.
    ///
    /// # Errors
    /// As [`Gpu::open_async`].
    pub fn open(choice: AdapterChoice) -> Result<Self, GpuError> {
        block_on(Self::open_async(choice))
    }

    /// As [`Gpu::open_on_async`], and waits for it.
    ///
    /// # Errors
    /// As [`Gpu::open_on_async`].
    pub fn open_on(choice: AdapterChoice, backends: wgpu::Backends) -> Result<Self, GpuError> {
        block_on(Self::open_on_async(choice, backends))
    }
}

impl Shader {
    /// As [`Shader::new_async`], and waits for it.
    ///
    /// # Errors
    /// As [`Shader::new_async`].
    pub fn new(gpu: &Gpu, method: &dyn Method, optics: &Optics) -> Result<Self, GpuError> {
        block_on(Self::new_async(gpu, method, optics))
    }

    /// As [`Shader::of_async`], and waits for it.
    ///
    /// # Errors
    /// As [`Shader::of_async`].
    pub fn of(gpu: &Gpu, shader: &MethodShader<'_>, answers: AnswerKind, optics: &Optics) -> Result<Self, GpuError> {
        block_on(Self::of_async(gpu, shader, answers, optics))
    }

    /// As [`Shader::evaluate_async`], and waits for it.
    ///
    /// # Errors
    /// As [`Shader::evaluate_async`].
    pub fn evaluate(&self, gpu: &Gpu, queries: &[Query]) -> Result<Answers, GpuError> {
        block_on(self.evaluate_async(gpu, queries))
    }

    /// As [`Shader::brdf_map_async`], and waits for it.
    ///
    /// # Errors
    /// As [`Shader::brdf_map_async`].
    pub fn brdf_map(&self, gpu: &Gpu, wi: [f32; 3], side: usize) -> Result<Vec<Option<[f32; 3]>>, GpuError> {
        block_on(self.brdf_map_async(gpu, wi, side))
    }
}

impl Renderer {
    /// As [`Renderer::draw_async`], and waits for it.
    ///
    /// # Errors
    /// As [`Renderer::draw_async`].
    pub fn draw(
        &self,
        gpu: &Gpu,
        scene: &Scene,
        shader: &Shader,
        target: &Target,
        view: &View,
    ) -> Result<FrameReport, GpuError> {
        block_on(self.draw_async(gpu, scene, shader, target, view))
    }
}

impl Target {
    /// As [`Target::read_picture_async`], and waits for it.
    ///
    /// # Errors
    /// As [`Target::read_picture_async`].
    pub fn read_picture(&self, gpu: &Gpu) -> Result<Vec<[f32; 3]>, GpuError> {
        block_on(self.read_picture_async(gpu))
    }

    /// As [`Target::read_queries_async`], and waits for it.
    ///
    /// # Errors
    /// As [`Target::read_queries_async`].
    pub fn read_queries(&self, gpu: &Gpu) -> Result<Vec<Query>, GpuError> {
        block_on(self.read_queries_async(gpu))
    }

    /// As [`Target::read_query_async`], and waits for it.
    ///
    /// # Errors
    /// As [`Target::read_query_async`].
    pub fn read_query(&self, gpu: &Gpu, column: u32, row: u32) -> Result<Query, GpuError> {
        block_on(self.read_query_async(gpu, column, row))
    }
}
